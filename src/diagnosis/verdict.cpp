// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/verdict.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/text.h"

namespace backlash::diagnosis {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
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

double width(const Estimate& e) {
  return std::isnan(e.angle_lower) ? kInfinity : upper(e) - e.angle_lower;
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

/// Whether the verdict should use set `a` instead of set `b`: it is larger, or equally large with narrower
/// intervals. Both sorted.
bool better(const Estimates& all, const Set& a, const Set& b) {
  if (a.size() != b.size()) return a.size() > b.size();
  for (std::size_t i = 0; i < a.size(); ++i)
    if (width(all[a[i]]) != width(all[b[i]])) return width(all[a[i]]) < width(all[b[i]]);
  return false;
}

/// All largest sets of sound estimates whose intervals share a point, the best one first. Intervals on a line
/// that overlap in pairs share a point, and the highest lower end among them is one. Estimates without
/// interval agree with nobody and count only where there is nothing else.
std::vector<Set> agreeing_sets(const Estimates& all) {
  std::vector<Set> sets;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!is_sound(all[i]) || !has_interval(all[i])) continue;
    const double point = all[i].angle_lower;
    Set set;
    for (std::size_t k = 0; k < all.size(); ++k)
      if (is_sound(all[k]) && all[k].angle_lower <= point && point <= upper(all[k]))
        set.push_back(static_cast<int>(k));
    std::sort(set.begin(), set.end(), [&all](int a, int b) { return sharper(all, a, b); });
    if (std::find(sets.begin(), sets.end(), set) == sets.end()) sets.push_back(set);
  }
  if (sets.empty()) {
    const auto blind = std::find_if(all.begin(), all.end(), is_sound);
    if (blind != all.end()) sets.push_back({static_cast<int>(blind - all.begin())});
  }
  std::stable_sort(sets.begin(), sets.end(),
                   [&all](const Set& a, const Set& b) { return better(all, a, b); });
  while (sets.size() > 1 && sets.back().size() < sets.front().size()) sets.pop_back();
  return sets;
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
  return {sum.value / weights, sum.lower / weights, sum.upper / weights};
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
  return {growth, growth - std::hypot(now.value - now.lower, then.upper - then.value),
          growth + std::hypot(now.upper - now.value, then.value - then.lower)};
}

/// A verdict in the making.
struct Judge {
  const Estimates& all;
  const std::optional<Limits>& limits;
  const std::optional<Baseline>& baseline;
  Set members, dissenters;
  bool undecided = false;  // contradiction without arbiter
  bool angular = false;    // what is graded and shown
  Amount now, growth;

  const char* unit() const { return angular ? " rad" : " m"; }

  Amount graded(const Amount& a) const {
    if (!baseline) return a;
    const Amount g = growth_since(*baseline, a, angular);
    return std::isfinite(level(g)) ? g : a;
  }

  void choose(const std::vector<Set>& sets) {
    members = sets.front();
    // Sets of one size that share the sharpest member are no contradiction: the members' order decides.
    for (const Set& other : sets)
      undecided |= std::find(other.begin(), other.end(), members.front()) == other.end();
    if (undecided)
      members = *std::max_element(sets.begin(), sets.end(), [this](const Set& a, const Set& b) {
        return level(combination(all, a, true)) < level(combination(all, b, true));
      });
    for (std::size_t i = 0; i < all.size(); ++i)
      if (is_sound(all[i]) && has_interval(all[i]) &&
          std::find(members.begin(), members.end(), static_cast<int>(i)) == members.end())
        dissenters.push_back(static_cast<int>(i));
  }

  /// The combination, widened to hold the dissenters where none can say who is right.
  Amount amount(bool in_angles) const {
    Amount a = combination(all, members, in_angles);
    if (!undecided) return a;
    for (const int i : dissenters) {
      const Amount other = amount_of(all[i], in_angles);
      a.lower = std::fmin(a.lower, other.lower);
      a.upper = std::fmax(a.upper, other.upper);
    }
    return a;
  }

  Grade grade() const {
    const Amount g = graded(combination(all, members, angular));
    if (!std::isfinite(level(g))) return Grade::cannot_tell;
    const bool bound = std::isnan(g.value);
    if (!limits) return bound || undecided ? Grade::cannot_tell : Grade::good;
    const Grade by_limits = grade_of(level(g), *limits);
    return bound && by_limits == Grade::good ? Grade::cannot_tell : by_limits;
  }

  /// The worse grade that the interval reaches into, if any.
  std::string not_excluded(Grade given) const {
    if (!limits || given == Grade::cannot_tell) return {};
    const Grade worst = grade_of(graded(now).upper, *limits);
    return worst > given ? std::string(", but ") + to_string(worst) + " cannot be excluded" : std::string();
  }

  std::string contradictions(Grade given) const {
    std::vector<std::string> parts;
    for (const int i : dissenters) {
      const Amount a = amount_of(all[i], angular);
      std::string part = all[i].method + " " + shown(a, unit());
      if (limits && !undecided && grade_of(level(graded(a)), *limits) > given)
        part += std::string(", ") + to_string(grade_of(level(graded(a)), *limits)) + " by itself";
      parts.push_back(part);
    }
    if (parts.empty()) return {};
    const std::string who = "; disagree: " + joined(parts);
    return undecided ? who + "; nothing tells who is right, graded by the larger" : who;
  }

  std::string since_baseline() const {
    if (!baseline || !std::isfinite(level(growth))) return {};
    std::string text = ", grown by " + shown(growth, unit()) + " since the baseline";
    const auto& then = baseline->methods;
    const bool shared = std::any_of(members.begin(), members.end(), [&](int i) {
      return std::find(then.begin(), then.end(), all[i].method) != then.end();
    });
    return then.empty() || shared ? text : text + " (by other methods: " + joined(then) + ")";
  }
};

double closed(double end) {
  return std::isfinite(end) ? end : kNaN;
}

void put(Verdict& verdict, const Judge& judge) {
  const Amount length = judge.amount(false), angle = judge.amount(true);
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

Verdict nothing_sound(const Estimates& estimates) {
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
    case Grade::cannot_tell:
      break;
  }
  return "cannot_tell";
}

Verdict combine(const std::vector<Estimate>& estimates, const std::optional<Limits>& limits,
                const std::optional<Baseline>& baseline) {
  const std::vector<Set> sets = agreeing_sets(estimates);
  if (sets.empty()) return nothing_sound(estimates);
  Judge judge{estimates, limits, baseline, {}, {}, false, false, {}, {}};
  judge.choose(sets);
  judge.angular = limits ? limits->angular : std::isnan(level(combination(estimates, judge.members, false)));
  judge.now = judge.amount(judge.angular);
  if (baseline) judge.growth = growth_since(*baseline, judge.now, judge.angular);
  Verdict verdict;
  verdict.members = judge.members;
  verdict.dissenters = judge.dissenters;
  verdict.estimate = judge.members.front();
  verdict.agreement = !judge.dissenters.empty()  ? "disagree: " + names(estimates, judge.dissenters)
                      : judge.members.size() > 1 ? "agree"
                                                 : "single";
  put(verdict, judge);
  verdict.grade = judge.grade();
  verdict.message = std::string(to_string(verdict.grade)) + judge.not_excluded(verdict.grade) +
                    ": backlash " + shown(judge.now, judge.unit()) + " by " +
                    names(estimates, judge.members) + judge.since_baseline() +
                    judge.contradictions(verdict.grade);
  return verdict;
}

}  // namespace backlash::diagnosis
