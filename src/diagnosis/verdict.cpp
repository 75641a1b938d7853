// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/verdict.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "backlash_diagnosis/base/text.h"

namespace backlash::diagnosis {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Theory: times the 95 % interval, four standard deviations. Of five right intervals one in five times misses
// another, and that is no contradiction.
constexpr double kContradiction = 2;
using Estimates = std::vector<Estimate>;
using Set = std::vector<int>;  // indices of estimates

bool is_bound(const Estimate& e) {
  return e.status == Status::above_range && std::isfinite(e.angle_lower);
}

bool is_sound(const Estimate& e) {
  return e.status == Status::ok || is_bound(e);
}

/// Upper end of the interval; infinite for a lower bound.
double upper(const Estimate& e) {
  return std::isnan(e.angle_upper) ? kInfinity : e.angle_upper;
}

/// Of the interval without what declared values leave open: all methods rest on them, few include it.
double width(const Estimate& e) {
  if (std::isnan(e.angle_lower) || !std::isfinite(upper(e))) return kInfinity;
  if (!(e.declared > 0)) return upper(e) - e.angle_lower;
  const double half = std::max(upper(e) - e.backlash_angle, e.backlash_angle - e.angle_lower);
  return 2 * std::sqrt(std::max(0.0, half * half - e.declared * e.declared));
}

bool has_interval(const Estimate& e) {
  return std::isfinite(e.angle_lower);
}

/// Narrower first, of bounds the higher one; then the order of the estimates.
bool sharper(const Estimates& all, int a, int b) {
  if (width(all[a]) != width(all[b])) return width(all[a]) < width(all[b]);
  if (is_bound(all[a]) && all[a].angle_lower != all[b].angle_lower)
    return all[a].angle_lower > all[b].angle_lower;
  return a < b;
}

/// The highest lower end among them is common to intervals on a line that overlap in pairs. `times`: as wide
/// as they are, to either side of their values.
bool share_a_point(const Estimates& all, const Set& set, double times) {
  double lower = 0, least_upper = kInfinity;
  for (const int i : set) {
    const Estimate& e = all[i];
    const double more = std::isfinite(e.backlash_angle) ? times - 1 : 0;
    lower = std::max(lower, e.angle_lower - (more > 0 ? more * (e.backlash_angle - e.angle_lower) : 0));
    least_upper = std::min(least_upper, upper(e) + (more > 0 ? more * (upper(e) - e.backlash_angle) : 0));
  }
  return lower <= least_upper;
}

template <typename Keep>
Set filtered(const Set& set, Keep keep) {
  Set kept;
  std::copy_if(set.begin(), set.end(), std::back_inserter(kept), keep);
  return kept;
}

bool same_witness(const Estimate& a, const Estimate& b) {
  return &a == &b || (!a.witness.empty() && a.witness == b.witness);
}

/// Without those whose witness contradicts itself, unless no other witness is there.
Set consistent(const Estimates& all, const Set& sound) {
  Set kept = filtered(sound, [&](int i) {
    return share_a_point(all, filtered(sound, [&](int k) { return same_witness(all[i], all[k]); }),
                         kContradiction);
  });
  return kept.empty() ? sound : kept;
}

/// Who the verdict stands on, and why the others do not count.
struct Choice {
  Set members, dissenters;
  Set agree;           // say the same as the members and are not needed
  Set parts;           // free play, where the members give that with the deflection under torque
  std::string reason;  // of the choice, where there are dissenters
};

/// Moves free play that fits into the play from wall to wall from the sound ones to the parts.
void set_parts(const Estimates& all, Choice& choice, Set& sound) {
  const Set whole = filtered(sound, [&](int i) { return all[i].deflection > 0; });
  const Set free = filtered(sound, [&](int i) { return !(all[i].deflection > 0); });
  const auto fits = [&](int part, int k) {
    return all[part].angle_lower <= upper(all[k]) &&
           upper(all[part]) >= all[k].angle_lower - all[k].deflection;
  };
  const bool fit = std::all_of(free.begin(), free.end(), [&](int i) {
    return std::all_of(whole.begin(), whole.end(), [&](int k) { return fits(i, k); });
  });
  if (whole.empty() || free.empty() || !fit) return;
  choice.parts = free;
  sound = whole;
}

/// See combine(). Estimates without interval agree with nobody and count only where there is nothing else.
Choice choose(const Estimates& all) {
  Choice choice;
  Set sound;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (is_sound(all[i]) && has_interval(all[i])) sound.push_back(static_cast<int>(i));
  if (sound.empty()) {
    const auto blind = std::find_if(all.begin(), all.end(), is_sound);
    if (blind != all.end()) choice.members = {static_cast<int>(blind - all.begin())};
    return choice;
  }
  set_parts(all, choice, sound);
  choice.members = consistent(all, sound);
  if (choice.members.size() < sound.size()) choice.reason = "what rests on the same contradicts itself";
  if (!share_a_point(all, choice.members, kContradiction)) {
    const Set measured = filtered(choice.members, [&](int i) { return all[i].from_record; });
    choice.reason = "the record itself shows what the others take from the rig file: is it this machine's?";
    if (measured.empty() || !share_a_point(all, measured, kContradiction)) {
      choice.members.clear();
      choice.reason = "nothing in the record shows which is right";
    } else {
      choice.members = measured;
    }
  }
  choice.dissenters = filtered(sound, [&](int i) {
    return std::find(choice.members.begin(), choice.members.end(), i) == choice.members.end();
  });
  const Set fitted = filtered(choice.members, [&](int i) { return all[i].fits_machine; });
  if (!fitted.empty()) {
    choice.agree = filtered(choice.members, [&](int i) { return !all[i].fits_machine; });
    choice.members = fitted;
  }
  std::sort(choice.members.begin(), choice.members.end(), [&](int a, int b) { return sharper(all, a, b); });
  return choice;
}

/// A value with its interval; NaN where not known, an open end is infinite.
struct Amount {
  double value = kNaN, lower = kNaN, upper = kNaN;
};

Amount amount_of(const Estimate& e, bool angular) {
  Amount a =
      angular ? Amount{e.backlash_angle, e.angle_lower, e.angle_upper} : Amount{e.backlash, e.lower, e.upper};
  if (std::isnan(a.upper) && is_bound(e)) a.upper = kInfinity;
  return a;
}

/// Intervals that miss each other and do not contradict: the truth may lie in any of them. And what one of
/// them saw, the others did not look for.
Amount hull(const Estimates& all, const Set& members, Amount sum, bool angular) {
  for (const int i : members) {
    const Amount a = amount_of(all[i], angular);
    if (std::isnan(a.value)) continue;
    sum.lower = std::min(sum.lower, a.lower);
    sum.upper = std::max(sum.upper, a.upper);
  }
  return sum;
}

/// See combine(). Members are sorted, the sharpest first. A member that knows no length says nothing of
/// lengths.
Amount combination(const Estimates& all, const Set& members, bool angular) {
  const double sharpest = width(all[members.front()]);
  if (!std::isfinite(sharpest)) return amount_of(all[members.front()], angular);
  Amount sum = {0, 0, 0};
  double weights = 0;
  for (const int i : members) {
    const double relative = sharpest > 0 ? width(all[i]) / sharpest : width(all[i]) > 0 ? kInfinity : 1;
    const Amount a = amount_of(all[i], angular);
    if (!std::isfinite(relative) || std::isnan(a.value)) continue;
    const double weight = 1 / (relative * relative);
    sum = {sum.value + weight * a.value, sum.lower + weight * a.lower, sum.upper + weight * a.upper};
    weights += weight;
  }
  const Amount mean = {sum.value / weights, sum.lower / weights, sum.upper / weights};
  if (!share_a_point(all, members, 1)) return hull(all, members, mean, angular);
  return hull(all, filtered(members, [&](int i) { return all[i].must_hold; }), mean, angular);
}

/// Value, or lower bound where there is none: what is compared and graded.
double level(const Amount& a) {
  return std::isnan(a.value) ? a.lower : a.value;
}

Grade grade_of(double value, const Limits& limits) {
  if (value >= limits.stop) return Grade::stop;
  if (value >= limits.service) return Grade::service;
  return value >= limits.watch ? Grade::watch : Grade::good;
}

std::string shown(const Amount& a, const char* unit) {
  if (std::isnan(a.value)) return fmt::format("at least {:.4g}{}", a.lower, unit);
  if (!std::isfinite(a.lower)) return fmt::format("{:.4g}{}", a.value, unit);
  if (std::isinf(a.upper)) return fmt::format("{:.4g}{} (95 %: {:.4g} or more)", a.value, unit, a.lower);
  return fmt::format("{:.4g}{} (95 %: {:.4g} to {:.4g})", a.value, unit, a.lower, a.upper);
}

std::string names(const Estimates& all, const Set& set) {
  std::vector<std::string> methods;
  for (const int i : set) methods.push_back(all[i].method);
  return joined(methods);
}

Amount growth_since(const Baseline& b, const Amount& now, bool angular) {
  const Amount then =
      angular ? Amount{b.backlash_angle, b.angle_lower, b.angle_upper} : Amount{b.backlash, b.lower, b.upper};
  if (std::isnan(now.value)) {  // a bound now
    const double up = std::isnan(then.upper) ? then.value : then.upper;
    return {kNaN, now.lower - up, kInfinity};
  }
  const double growth = now.value - then.value;
  const auto apart = [](double x, double y) { return std::isnan(x - y) ? 0 : x - y; };  // not known: exact
  return {growth, growth - std::hypot(now.value - now.lower, apart(then.upper, then.value)),
          growth + std::hypot(now.upper - now.value, apart(then.value, then.lower))};
}

/// A verdict in the making.
struct Judge {
  const Estimates& all;
  const std::optional<Limits>& limits;
  const std::optional<Baseline>& baseline;
  const Choice choice;
  bool angular = false;  // what is graded and shown
  Amount now, growth;

  const char* unit() const { return angular ? " rad" : " m"; }

  Amount graded(const Amount& a) const {
    if (!baseline) return a;
    const Amount g = growth_since(*baseline, a, angular);
    return std::isfinite(level(g)) ? g : a;
  }

  /// The worst grade that the interval reaches. An interval that is not known may reach all.
  Grade worst() const {
    const double up = graded(now).upper;
    return grade_of(std::isnan(up) ? kInfinity : up, *limits);
  }

  Grade best() const {
    const double low = graded(now).lower;
    return grade_of(std::isnan(low) ? 0 : low, *limits);
  }

  Grade grade() const {
    const Amount g = graded(now);
    if (!std::isfinite(level(g))) return Grade::cannot_tell;
    const bool bound = std::isnan(g.value);
    if (!limits) return bound ? Grade::cannot_tell : Grade::ungraded;
    const Grade by_value = grade_of(level(g), *limits);
    if (by_value != Grade::good || worst() == Grade::good) return by_value;
    return bound ? Grade::cannot_tell : Grade::watch;
  }

  /// The other grades that the interval reaches into.
  std::string may_be(Grade given) const {
    if (given == Grade::ungraded) return " (no limits are given)";
    if (given == Grade::cannot_tell) return {};
    std::string others;
    if (best() < given) others = to_string(best());
    if (worst() > given) others += (others.empty() ? "" : " or ") + std::string(to_string(worst()));
    return others.empty() ? others : ", may be " + others;
  }

  /// The free play within a play from wall to wall.
  std::string parts() const {
    std::string text;
    for (const int i : choice.parts)
      text += "; free play within it by " + all[i].method + " " + shown(amount_of(all[i], angular), unit());
    return text;
  }

  std::string contradictions() const {
    std::vector<std::string> parts;
    for (const int i : choice.dissenters) {
      const Amount a = amount_of(all[i], angular);
      std::string part = all[i].method + " " + shown(a, unit());
      if (limits) part += std::string(", ") + to_string(grade_of(level(graded(a)), *limits)) + " by itself";
      parts.push_back(part);
    }
    return parts.empty() ? std::string() : "; disagree: " + joined(parts) + "; " + choice.reason;
  }

  std::string since_baseline() const {
    if (!baseline || !std::isfinite(level(growth))) return {};
    std::string text = ", grown by " + shown(growth, unit()) + " since the baseline";
    const auto& then = baseline->methods;
    const bool shared = std::any_of(choice.members.begin(), choice.members.end(), [&](int i) {
      return std::find(then.begin(), then.end(), all[i].method) != then.end();
    });
    return then.empty() || shared ? text : text + " (by other methods: " + joined(then) + ")";
  }
};

double closed(double end) {
  return std::isfinite(end) ? end : kNaN;
}

void put(Verdict& verdict, const Judge& judge) {
  const Amount length = combination(judge.all, judge.choice.members, false),
               angle = combination(judge.all, judge.choice.members, true);
  verdict.backlash = length.value;
  verdict.lower = closed(length.lower);
  verdict.upper = closed(length.upper);
  verdict.backlash_angle = angle.value;
  verdict.angle_lower = closed(angle.lower);
  verdict.angle_upper = closed(angle.upper);
  verdict.growth = level(judge.growth);
  verdict.growth_lower = closed(judge.growth.lower);
  verdict.growth_upper = closed(judge.growth.upper);
}

/// What is wrong in the rig file, beside the answer.
Verdict with_declared_wrong(Verdict verdict, const Estimates& all) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Estimate& e = all[i];
    const Set& against = verdict.dissenters;
    const bool believed = e.status == Status::ok || e.status == Status::below_range;
    if (!believed || std::find(against.begin(), against.end(), static_cast<int>(i)) != against.end())
      continue;
    verdict.declared_wrong.insert(verdict.declared_wrong.end(), e.declared_wrong.begin(),
                                  e.declared_wrong.end());
  }
  const std::string text = contradiction_text(verdict.declared_wrong);
  if (verdict.message.find(text) == std::string::npos) verdict.message += "; " + text;
  return verdict;
}

/// Methods that looked at the record and refused it come first, then those that lack something.
Verdict nothing_sound(Estimates estimates) {
  std::stable_partition(estimates.begin(), estimates.end(),
                        [](const Estimate& e) { return e.status != Status::insufficient_data; });
  Verdict verdict;
  verdict.agreement = "none";
  verdict.message = "cannot tell";
  for (const Estimate& e : estimates)
    verdict.message += "; " + e.method + ": " + to_string(e.status) + " (" + e.message + ")";
  return verdict;
}

}  // namespace

const char* to_string(Grade grade) {
  switch (grade) {
    case Grade::good:
      return "good";
    case Grade::watch:
      return "watch";
    case Grade::service:
      return "service";
    case Grade::stop:
      return "stop";
    case Grade::ungraded:
      return "ungraded";
    case Grade::cannot_tell:
      break;
  }
  return "cannot_tell";
}

Verdict combine(const std::vector<Estimate>& estimates, const std::optional<Limits>& limits,
                const std::optional<Baseline>& baseline) {
  Judge judge{estimates, limits, baseline, choose(estimates), false, {}, {}};
  const Set &members = judge.choice.members, &dissenters = judge.choice.dissenters;
  if (members.empty() && dissenters.empty()) return with_declared_wrong(nothing_sound(estimates), estimates);
  const Set& shown_ones = members.empty() ? dissenters : members;
  judge.angular = limits ? limits->angular : std::isnan(level(combination(estimates, shown_ones, false)));
  Verdict verdict;
  verdict.members = members;
  verdict.dissenters = dissenters;
  verdict.agreement = !dissenters.empty() ? "disagree: " + names(estimates, dissenters)
                      : members.size() > 1 || !judge.choice.agree.empty() ? "agree"
                                                                          : "single";
  if (members.empty()) {
    verdict.message = "cannot tell" + judge.contradictions();
    return with_declared_wrong(std::move(verdict), estimates);
  }
  verdict.estimate = members.front();
  judge.now = combination(estimates, members, judge.angular);
  if (baseline) judge.growth = growth_since(*baseline, judge.now, judge.angular);
  put(verdict, judge);
  verdict.grade = judge.grade();
  verdict.message =
      std::string(to_string(verdict.grade)) + judge.may_be(verdict.grade) + ": backlash " +
      shown(judge.now, judge.unit()) + " by " + names(estimates, members) +
      (judge.choice.agree.empty() ? "" : " (" + names(estimates, judge.choice.agree) + " agree)") +
      judge.since_baseline() + judge.parts() + judge.contradictions();
  return with_declared_wrong(std::move(verdict), estimates);
}

}  // namespace backlash::diagnosis
