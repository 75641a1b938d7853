// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "backlash_diagnosis/arm/fit_records.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "fit_model.h"
#include "joint_effects.h"
#include "trace_chain.h"
#include "trace_effects.h"
#include "trace_evidence.h"
#include "trace_result.h"

namespace backlash::arm {
namespace {

const char* const kHalves =
    "The test record is of a machine that has changed: effects are fitted to its first half and judged on "
    "its second half.";

Motions parts(const Motions& motions, double from, double to) {
  Motions out;
  for (const ArmMotion& m : motions)
    if (ArmMotion part = part_of(m, from, to); !part.rows.empty()) out.push_back(std::move(part));
  return out;
}

/// Where one half of the samples lies before.
double middle(const Motions& motions) {
  std::size_t all = 0, seen = 0;
  for (const ArmMotion& m : motions) all += m.rows.size();
  for (const ArmMotion& m : motions) {
    if (2 * (seen + m.rows.size()) >= all) return m.time[m.rows[std::min(all / 2 - seen, m.rows.size() - 1)]];
    seen += m.rows.size();
  }
  return 0;
}

using FrictionAlike = std::map<std::size_t, std::vector<std::string>>;  // effects, by joint

class Tracer {
 public:
  Tracer(const ArmRig& rig, const ArmTraceSettings& settings, const Progress& progress)
      : rig_(rig), settings_(settings), progress_(progress), fits_(rig, train_, settings) {}

  ArmTrace run(const std::vector<ArmRecord>& train, const ArmRecord& test, bool same_record);

 private:
  void report(double fraction, const char* phase) const {
    if (progress_ && !progress_(fraction, phase)) throw Cancelled();
  }
  void set_base();
  bool changed_since(const Motions& first, const Motions& second);
  void search_all(bool same_record);
  void cannot_judge(const std::string& why);
  void look_for_pushes(const ArmRecord& test);
  bool holds(const Candidate& found, const Candidate& last, const Motions& judged) const;
  bool search(const Motions& fitted, const Motions& judged, const std::string& words);
  void report_chain(const std::vector<Candidate>& all, std::size_t best, const Candidate& last,
                    const Motions& judged);
  void report_effects(const std::vector<Candidate>& found, const Motions& judged);
  void report_onset(const Candidate& c);
  void report_rival(ArmStep& step, const Candidate& rival);
  void report_friction(const Candidate& c, const Motions& judged, const FrictionAlike& alike);
  void finish(const Motions& judged, const Candidate& taken, bool named);
  std::optional<ArmTrace::Unexplained> worst_unexplained(const std::vector<double>& errors,
                                                         const std::vector<double>& expected) const;
  std::optional<ArmTrace::Unexplained> worst_left(const std::vector<double>& errors) const;

  ArmRig rig_;
  const ArmTraceSettings& settings_;
  const Progress& progress_;
  Motions train_, test_;
  CandidateFits fits_;
  Candidate taken_;    // what was named
  Candidate unnamed_;  // what predicts the test record best where nothing is named
  ArmTrace trace_;
};

void require_one_arm(const ArmFit& fit) {
  if (!fit.contradictions.empty()) throw CannotIdentify(description(fit.contradictions));
}

void Tracer::set_base() {
  if (rig_.fitted)
    fits_.base.rig = rig_;
  else
    fits_.base = fit_arm_and_friction_turns(rig_, train_, settings_.fit);
  for (ArmMotion& m : test_) set_friction_turns(m, rig_);
  for (const std::string& warning : fits_.base.warnings) trace_.warnings.push_back(warning);
  fits_.train_errors = relative_errors(fits_.base, {}, as_fitted(train_, false), settings_.fit.least_seconds);
  trace_.train = fits_.train_errors;
}

void Tracer::report_effects(const std::vector<Candidate>& found, const Motions& judged) {
  for (const Candidate& c : found) {
    const double law = fits_.share_known(c, found.back(), judged);
    trace_.steps.push_back(step_of(c, found.back().fit, rig_, law));
    report_onset(c);
  }
}

/// Notes whether the training records have the effect of a joint.
void Tracer::report_onset(const Candidate& c) {
  const FreeEffect& effect = c.freedom.effects.back();
  if (!rig_.fitted && !effect.everywhere)
    trace_.notes.push_back(effect.effect.id + " of " + rig_.joints[effect.joint].name +
                           " is of the test record, the training records do not have it");
}

/// A body taken away on one side does nearly what a body added on the other side does: the intervals contain
/// both.
void Tracer::report_rival(ArmStep& step, const Candidate& rival) {
  const ArmStep other = step_of(rival, rival.fit, rig_, settings_.law);
  for (std::size_t i = 0; i < step.parameters.size(); ++i) {
    signal::Measured& m = step.parameters[i].measured;
    m.standard_error = std::hypot(m.standard_error, other.parameters[i].measured.value - m.value);
  }
  step.equivalent_to.emplace_back("payload (taken away)");
  trace_.notes.push_back(fmt::format(
      "a body that is gone does nearly as well as one that has come: {:.3g} kg; motion with faster turns, or "
      "other poses, would distinguish them",
      rival.fit.marked().mass.value));
}

/// Where friction is not that of the training: a step where it is more than a robot's warming up, else a
/// note.
void Tracer::report_friction(const Candidate& c, const Motions& judged, const FrictionAlike& alike) {
  Candidate base;
  base.fit = fits_.base;
  Candidate against = c;
  judge(against, base, judged, rig_, settings_);
  const std::vector<double> expected = fits_.expected_errors(c, judged),
                            errors = relative_errors(c.fit, c.freedom, as_fitted(judged, true), 0);
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
    const signal::Measured& f = c.fit.marked().friction_factors[j];
    if (!(std::fabs(f.value - 1) > settings_.sure * f.standard_error)) continue;
    const bool much = other_friction_than_trained(c.fit, j, settings_);
    const std::string words =
        fmt::format("friction of {} is {:.2f} +- {:.2f} times that of the training records",
                    rig_.joints[j].name, f.value, f.standard_error);
    const double left = errors[j] / expected[j];
    std::string doubt;
    if (!much)
      doubt = ", as a robot's that warms up";
    else if (!(against.gains[j] > settings_.least_gain) || !(against.lowers[j] > 0))
      doubt = ", which the part that was not fitted does not confirm";
    else if (!(left < settings_.explained))
      doubt = fmt::format(
          ", but that is not what it lacks: the error is then {:.3g} times what the training records let "
          "expect",
          left);
    if (!doubt.empty()) {
      trace_.notes.push_back(words + doubt);
      continue;
    }
    ArmStep step;
    step.effect = "friction_drift";
    step.joint = rig_.joints[j].name;
    step.channel = step.joint + "/torque";
    step.parameters = {{"factor", "-", f}};
    step.gain = against.gains[j], step.gain_lower = against.lowers[j], step.gain_upper = against.uppers[j];
    if (const auto others = alike.find(j); others != alike.end()) step.equivalent_to = others->second;
    trace_.steps.push_back(step);
  }
}

/// What is reported of the chain, with values of a fit that has all that was found.
void Tracer::report_chain(const std::vector<Candidate>& all, std::size_t best, const Candidate& last,
                          const Motions& judged) {
  const Candidate& named = all[best];
  const double law = of_joint(named) ? fits_.share_known(named, last, judged) : settings_.law;
  ArmStep step = step_of(named, last.fit, rig_, law);
  if (const Candidate* rival = rival_of(all, best, settings_)) report_rival(step, *rival);
  for (const std::string& name : as_good_as(all, best, settings_)) step.equivalent_to.push_back(name);
  trace_.steps.push_back(step);
  if (of_joint(named)) report_onset(named);
  const double common = rig_.fitted ? rig_.common_error : last.fit.rig.common_error;
  if (named.freedom.payload && common > 0)
    trace_.notes.push_back(fmt::format(
        "the mass scales with the torque constants, which together are known to {:.2g} % (part of its "
        "error); a known weight measures them (identify --payload)",
        100 * common));
  for (const Candidate& c : all)
    if (c.reason.empty() && named.freedom.payload && c.freedom.payload &&
        *c.freedom.payload != *named.freedom.payload &&
        named.all - c.all < -std::log(1 - settings_.same_link))
      trace_.notes.push_back("a payload at " + rig_.chain.joints[*c.freedom.payload].link +
                             " does nearly as well");
}

/// Whether what was found of the chain still holds beside what was found after it, and explains the
/// joints: where one is left unexplained, values that take most of it away need not be those of the machine.
/// What the training records show may be another one in the test record, see changed_since().
bool Tracer::holds(const Candidate& found, const Candidate& last, const Motions& judged) const {
  if (!(errors_from_none(found, last.fit) > settings_.sure)) return false;
  const std::vector<double> expected = fits_.expected_errors(last, judged),
                            errors = relative_errors(last.fit, last.freedom, as_fitted(judged, true), 0);
  for (std::size_t j = 0; &judged != &test_ && j < errors.size(); ++j) {
    const double most =
        of_joint(found) && j == found.joint ? most_left(found, settings_) : settings_.most_of_expected;
    if (errors[j] > most * expected[j]) return false;
  }
  return true;
}

/// True where something was found.
bool Tracer::search(const Motions& fitted, const Motions& judged, const std::string& words) {
  Candidate without;
  fits_.fit(without, fitted);
  std::vector<Candidate> all = chain_candidates(rig_);
  const std::vector<double> gains = gain_shares(without.fit, without.freedom, as_fitted(fitted, true));
  for (std::size_t i = 0; i < all.size(); ++i) {
    report(0.2 + 0.7 * double(i) / double(all.size()), "trying effects");
    // The last link shows whether something has come or gone.
    if (all[i].freedom.payload && i > 1 && (all[0].all > all[1].all) != (all[i].freedom.payload_sign > 0))
      all[i].reason = "not tried";
    else if (of_joint(all[i]) && gains[all[i].joint] < settings_.least_at_joint / 2)
      all[i].reason =
          fmt::format("would take {:.0f} % of what is left of the joint", 100 * gains[all[i].joint]);
    else
      fits_.try_out(all[i], without, fitted, judged);
  }
  trace_.rejected.clear();
  for (std::size_t i = 0; i < all.size(); ++i)
    if (!all[i].reason.empty() && (i < 2 || !all[i].freedom.payload))
      trace_.rejected.push_back({all[i].effect + (all[i].freedom.payload_sign < 0 ? " (taken away)" : ""),
                                 all[i].reason, of_joint(all[i]) ? rig_.joints[all[i].joint].name : ""});
  trace_.notes.clear();
  std::size_t best = best_of(all, settings_);
  report(0.9, "trying effects of single joints");
  JointEffectsFound effects = joint_effects(best < all.size() ? all[best] : without, fits_, fitted, judged);
  if (best < all.size() &&
      !holds(all[best], effects.steps.empty() ? all[best] : effects.steps.back(), judged)) {
    trace_.rejected.push_back({all[best].effect,
                               "leaves a joint unexplained, or is none beside what was found after it",
                               of_joint(all[best]) ? rig_.joints[all[best].joint].name : ""});
    best = all.size();
    effects = joint_effects(without, fits_, fitted, judged);
  }
  const Candidate& of_chain = best < all.size() ? all[best] : without;
  trace_.rejected.insert(trace_.rejected.end(), effects.rejected.begin(), effects.rejected.end());
  const Candidate& taken = effects.steps.empty() ? of_chain : effects.steps.back();
  if (best < all.size()) report_chain(all, best, taken, judged);
  report_effects(effects.steps, judged);
  report_friction(taken, judged, effects.friction_alike);
  if (trace_.steps.empty()) {
    unnamed_ = without;
    return false;
  }
  trace_.judged = words;
  taken_ = taken;
  finish(judged, taken, true);
  for (ArmStep& step : trace_.steps) step.before = trace_.before, step.after = trace_.after;
  return true;
}

/// Errors on the part that is judged, and the rig with what is named; `taken` is the model that predicts
/// best, also where nothing of it is named.
void Tracer::finish(const Motions& judged, const Candidate& taken, bool named) {
  const double least = settings_.fit.least_seconds;
  const std::vector<double> best = relative_errors(taken.fit, taken.freedom, as_fitted(judged, true), least);
  trace_.before = relative_errors(fits_.base, {}, as_fitted(judged, false), least);
  trace_.after = named ? best : trace_.before;
  trace_.floor = noise_floors(judged, trace_.before);
  if (named) trace_.augmented = augmented_rig(rig_, taken);
  trace_.series = named ? series_of(judged, fits_.base, taken.freedom, taken.fit, true)
                        : series_of(judged, fits_.base, {}, fits_.base, false);
  trace_.unexplained = worst_unexplained(best, fits_.expected_errors(taken, judged));
}

std::optional<ArmTrace::Unexplained> Tracer::worst_unexplained(const std::vector<double>& errors,
                                                               const std::vector<double>& expected) const {
  std::optional<ArmTrace::Unexplained> out;
  double worst = settings_.most_of_expected;
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
    const double ratio = errors[j] / expected[j];
    if (!(ratio > worst)) continue;
    worst = ratio;
    out = {rig_.joints[j].name + "/torque",
           fmt::format("the error is {:.3g} times what the training records let expect", ratio)};
  }
  return out ? out : worst_left(errors);
}

/// The training records may leave as much, so that it is expected.
std::optional<ArmTrace::Unexplained> Tracer::worst_left(const std::vector<double>& errors) const {
  std::optional<ArmTrace::Unexplained> out;
  double worst = settings_.much;
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
    if (!(errors[j] > worst && errors[j] > settings_.far * trace_.floor[j])) continue;
    worst = errors[j];
    out = {rig_.joints[j].name + "/torque",
           fmt::format("{:.3g} % of it is left, {:.3g} times the noise of the sensors, as the training "
                       "records let expect: an effect that has no name here, or a torque from outside",
                       100 * errors[j], errors[j] / trace_.floor[j])};
  }
  return out;
}

void Tracer::look_for_pushes(const ArmRecord& test) {
  for (const PushEvent& e : pushes(test, fits_.base.rig, settings_.push)) {
    ArmStep step;
    step.effect = "external_torque";
    step.joint = rig_.joints[e.joint].name;
    step.channel = step.joint + "/torque";
    step.parameters = {{"torque", "N m", {-e.torque, e.torque_error}}};
    step.push = e;
    trace_.steps.push_back(step);
  }
}

/// Whether what was found in the training records is another one in the test record: then that counts.
bool Tracer::changed_since(const Motions& first, const Motions& second) {
  const ArmTrace in_training = trace_;
  const Candidate old = taken_;
  trace_.steps.clear(), trace_.floor.clear(), trace_.series = {}, trace_.unexplained.reset();
  if (search(first, second, kHalves)) {
    Candidate halves = taken_;
    judge(halves, old, second, rig_, settings_);
    if (halves.all > -std::log(1 - settings_.same_link) && halves.all_lower > 0) {
      for (const ArmStep& step : in_training.steps)
        trace_.notes.push_back(fmt::format("the training records show another one: {} {}{}, {} = {:.3g} {}",
                                           step.effect, step.link, step.joint, step.parameters[0].name,
                                           step.parameters[0].measured.value, step.parameters[0].unit));
      return true;
    }
  }
  trace_ = in_training;
  return false;
}

void Tracer::cannot_judge(const std::string& why) {
  for (auto* list : {&trace_.before, &trace_.after, &trace_.floor, &trace_.train})
    list->assign(rig_.joints.size(), kNaN);
  trace_.judged = why;
}

void Tracer::search_all(bool same_record) {
  const Motions first = parts(test_, -1e300, middle(test_)), second = parts(test_, middle(test_), 1e300);
  for (const Motions* half : {&first, &second}) {
    double moving = 0;
    for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
      double seconds = 0;
      for (const ArmMotion& m : *half) seconds += moving_seconds(m, j);
      moving = std::max(moving, seconds);
    }
    if (moving >= settings_.fit.least_seconds) continue;
    trace_.cannot_tell = true;
    return cannot_judge(
        fmt::format("No joint moves for {} s in a half of the test record: nothing can be judged.",
                    settings_.fit.least_seconds));
  }
  const bool in_training =
      rig_.fitted && !same_record &&
      search(train_, test_, "Effects are fitted to the training records and judged on the test record.");
  if (in_training) {
    changed_since(first, second);
    return;
  }
  if (search(first, second, kHalves)) return;
  trace_.judged = "Errors are those of the whole test record.";
  finish(test_, unnamed_, false);
}

ArmTrace Tracer::run(const std::vector<ArmRecord>& train, const ArmRecord& test, bool same_record) {
  trace_.joints = rig_.joint_names();
  report(0, "reading the motion");
  std::vector<RecordMotions> records;
  for (const ArmRecord& record : train) records.push_back(motions_of(record, rig_, trace_.warnings));
  for (const RecordMotions& record : records) train_.insert(train_.end(), record.begin(), record.end());
  test_ = motions_of(test, rig_, trace_.warnings);
  report(0.1, "fitting the base machine");
  try {
    if (!rig_.fitted) require_one_arm(fit_records(rig_, records, settings_.fit));
    set_base();
  } catch (const CannotIdentify& error) {
    trace_.augmented = rig_;
    trace_.cannot_tell = true;
    cannot_judge("The arm cannot be fitted to the training records: " + std::string(error.what()) + ".");
    return std::move(trace_);
  }
  trace_.augmented = fits_.base.rig;
  if (holds_pose(test, settings_.push)) {
    look_for_pushes(test);
    trace_.series = held_series(test, rig_.channel);
    cannot_judge(
        "The test record holds its pose: friction at rest hides what the drives carry, so no error is given; "
        "pushes are "
        "looked for.");
  } else {
    search_all(same_record);
  }
  return std::move(trace_);
}

}  // namespace

ArmTrace trace_arm(const ArmRig& rig, const std::vector<ArmRecord>& train, const ArmRecord& test,
                   bool same_record, const ArmTraceSettings& settings, const Progress& progress) {
  return Tracer(rig, settings, progress).run(train, test, same_record);
}

}  // namespace backlash::arm
