// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/changes/arm_changes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "backlash_diagnosis/arm/push.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/base/text.h"
#include "commissioned_arm.h"

namespace backlash::changes {
namespace {

class ArmChanges {
 public:
  ArmChanges(const arm::ArmRig& rig, const ChangeSettings& settings, const Progress& progress)
      : rig_(rig), settings_(settings), progress_(progress) {
    settings_.cutoff = rig.identification.torque_cutoff;
    settings_.position_cutoff = rig.identification.kinematics_cutoff;
    // The joints share the rate of false alarms: two channels each, and one for the chain.
    settings_.false_alarms_per_hour /= double(2 * rig.joints.size() + 1);
  }

  Changes run(const std::vector<arm::ArmRecord>& healthy, const arm::ArmRecord& record);

 private:
  void report(double share, const std::string& phase) const {
    if (progress_ && !progress_(share, phase)) throw Cancelled();
  }
  // Search
  void search(const arm::ArmRecord& record);
  void take(const FoundChainChange& found, const arm::ArmRecord& record);
  ChainDifference difference_of(const FoundChainChange& found, bool from_beginning, double end) const;
  // What is reported
  void report_pushes(const arm::ArmRecord& record);
  void report_joint(const ArmJoint& joint);
  void report_deflection(std::size_t index);
  void add(const std::string& joint, const Changes& one);
  void add_constant_error(const ArmJoint& joint, Change& change) const;
  double left(const FoundChainChange& f) const;
  Change change_of(const FoundChainChange& f) const;
  void add_scale();

  std::deque<ArmJoint>& joints() { return arm_->joints(); }
  const ArmJoint& first() const { return arm_->joints().front(); }

  const arm::ArmRig& rig_;
  ChangeSettings settings_;
  const Progress& progress_;
  std::optional<CommissionedArm> arm_;
  std::vector<FoundChainChange> chain_;    // reported
  std::vector<FoundChainChange> earlier_;  // and those that the record has from its beginning
  Changes out_;
};

ChainDifference ArmChanges::difference_of(const FoundChainChange& found, bool from_beginning,
                                          double end) const {
  const double start = first().motion.start;
  const bool to_end = found.to == first().search->blocks();
  ChainDifference d;
  d.joint = found.effect.joint;
  d.from = from_beginning ? start : start + settings_.block * double(found.from);
  d.to = to_end ? end + 1 : start + settings_.block * double(found.to);
  if (found.effect.values > 1)
    d.body = found.score.values;
  else
    d.slip = found.score.values[0];
  return d;
}

/// A change of the chain stands beside those of each joint from then on.
void ArmChanges::take(const FoundChainChange& found, const arm::ArmRecord& record) {
  const bool from_beginning = found.low <= 0;
  const double before = left(found);
  arm_->differ(difference_of(found, from_beginning, record.joints.front().time.back()), record);
  for (ArmJoint& joint : joints()) {
    FoundChange beside{found.effect.at_joint(),
                       found.from,
                       found.to,
                       {},
                       found.inflation,
                       found.score.gain / found.inflation,
                       {}};
    if (from_beginning) beside.from = 0;
    if (from_beginning && found.to == joint.search->blocks()) ++beside.to;
    joint.beside.push_back(beside);
    arm_->set_search(joint);
  }
  earlier_.push_back(found);
  if (!from_beginning) {
    chain_.push_back(found);
    chain_.back().error_before = before;
    return;
  }
  add_different(described(found.effect, rig_.chain), out_);
}

/// The clearest change first, of one joint or of the chain; then those in what it leaves.
void ArmChanges::search(const arm::ArmRecord& record) {
  std::deque<ArmJoint>& joints = arm_->joints();
  std::vector<std::optional<FoundChange>> next(joints.size());
  std::vector<char> stale(joints.size(), 1);
  for (int round = 0; round < settings_.most_changes * static_cast<int>(joints.size()); ++round) {
    std::size_t clearest = joints.size();
    for (std::size_t j = 0; j < joints.size(); ++j) {
      ArmJoint& joint = joints[j];
      const bool full = joint.found.size() >= static_cast<std::size_t>(settings_.most_changes);
      if (stale[j]) next[j] = full ? std::nullopt : joint.search->next(joint.found);
      stale[j] = 0;
      if (next[j] && (clearest == joints.size() || next[j]->score.gain > next[clearest]->score.gain))
        clearest = j;
    }
    std::optional<FoundChainChange> of_chain;
    if (earlier_.size() < static_cast<std::size_t>(settings_.most_changes))
      of_chain = ChainSearch(joints, rig_.chain, settings_).best(earlier_);
    if (of_chain && (clearest == joints.size() || of_chain->score.gain > next[clearest]->score.gain)) {
      take(*of_chain, record);
      stale.assign(joints.size(), 1);
    } else if (clearest < joints.size()) {
      joints[clearest].search->add(*next[clearest], joints[clearest].found);
      stale[clearest] = 1;
    } else {
      return;
    }
  }
}

void ArmChanges::report_pushes(const arm::ArmRecord& record) {
  const arm::PushSettings settings;
  for (const arm::PushEvent& e : arm::pushes(record, arm_->fit().rig, settings)) {
    Change change;
    change.effect = "external_torque";
    change.joint = rig_.joints[e.joint].name;
    change.since = e.begin;
    change.since_from = e.earliest;
    change.since_to = e.begin + settings_.onset_least;
    if (e.released) change.until = e.end;
    change.gain = e.clear * e.clear;
    change.error_before = change.error_after = kNaN;  // no torque is predicted while the arm rests
    change.size.push_back({"torque", "N m", {-e.torque, e.torque_error}});
    out_.changes.push_back(change);
  }
  const std::vector<double>& time = record.joints.front().time;
  out_.windows = static_cast<std::size_t>((time.back() - time.front()) / settings_.window);
  out_.warnings.emplace_back(
      "the record holds its pose: friction at rest hides what the drives carry, so pushes are looked for and "
      "nothing else");
}

/// What one channel of a joint shows.
void ArmChanges::add(const std::string& joint, const Changes& one) {
  const auto named = [&](const std::string& text) { return joint + ": " + text; };
  for (const Change& c : one.changes) {
    out_.changes.push_back(c);
    out_.changes.back().joint = joint;
  }
  for (const std::string& warning : one.warnings) out_.warnings.push_back(named(warning));
  for (const std::string& name : one.different) out_.different.push_back(named(name));
  for (const std::string& name : one.healthy_terms) out_.healthy_terms.push_back(named(name));
  if (!one.cannot_tell.empty())
    out_.cannot_tell += (out_.cannot_tell.empty() ? "" : "; ") + named(one.cannot_tell);
}

/// Torques are known no better than the torque constants.
void ArmChanges::add_constant_error(const ArmJoint& joint, Change& change) const {
  const double relative =
      std::hypot(arm_->fit().rig.common_error, arm_->fit().rig.joints[joint.index].constant_error);
  for (ChangeSize& s : change.size)
    if (s.name != "phase" && s.name != "order" && s.unit.find("N m") != std::string::npos)
      s.measured.standard_error = std::hypot(s.measured.standard_error, relative * s.measured.value);
}

void ArmChanges::report_joint(const ArmJoint& joint) {
  Changes one = reported_changes(*joint.search, joint.found, false, false, settings_);
  for (Change& c : one.changes) add_constant_error(joint, c);
  add(joint.name, one);
  out_.windows = std::max(out_.windows, one.windows);
  out_.threshold = one.threshold;
  out_.noise = std::max(out_.noise, one.noise);
}

/// N m, rms of what all joints leave while it lasts, beside all that is known by now.
double ArmChanges::left(const FoundChainChange& f) const {
  double squares = 0, rows = 0;
  for (const ArmJoint& joint : arm_->joints()) {
    double of_joint = 0;
    squares += joint.search->left_after(joint.search->background(joint.found), f.from, f.to, of_joint);
    rows += of_joint;
  }
  return std::sqrt(squares / std::max(rows, 1.0));
}

Change ArmChanges::change_of(const FoundChainChange& f) const {
  Change change;
  change.error_before = f.error_before;
  change.error_after = left(f);
  change.effect = f.effect.id;
  const arm::Joint& joint = rig_.chain.joints[f.effect.joint];
  change.joint = joint.name;
  const double start = first().motion.start;
  change.since = start + settings_.block * double(f.from);
  change.since_from = start + f.low;
  change.since_to = start + f.high;
  if (f.to < first().search->blocks()) change.until = start + settings_.block * double(f.to);
  change.gain = f.score.gain / f.inflation;
  change.alike = f.alike;
  const Eigen::VectorXd& x = f.score.values;
  Eigen::MatrixXd c = f.score.covariance * f.inflation;
  c.diagonal() += (settings_.model_error * x).cwiseAbs2();
  if (f.effect.values == 1) {
    change.size.push_back({"offset", "rad", {x[0], std::sqrt(c(0, 0))}});
    return change;
  }
  change.link = joint.link;
  const double mass_error = std::hypot(std::sqrt(c(0, 0)), x[0] * arm_->fit().rig.common_error);
  change.size.push_back({"mass", "kg", {x[0], mass_error}});
  static const char* const names[] = {"centre_x", "centre_y", "centre_z"};
  for (int i = 0; i < 3; ++i) {
    const double centre = x[1 + i] / x[0];
    const double variance =
        (c(1 + i, 1 + i) - 2 * centre * c(0, 1 + i) + centre * centre * c(0, 0)) / (x[0] * x[0]);
    change.size.push_back({names[i], "m", {centre, std::sqrt(std::max(0.0, variance))}});
  }
  return change;
}

/// With a second encoder behind the gap.
void ArmChanges::report_deflection(std::size_t index) {
  const std::string& name = rig_.joints[index].name;
  try {
    const std::optional<JointDeflection> deflection = arm_->deflection(index);
    if (!deflection) return;
    const HealthyModel& model = deflection->model;
    const HealthyScores scores(model, settings_);
    ChangeSearch search(model, deflection->motion, change_effects(model.sampling), scores, {}, settings_,
                        progress_);
    add(name, reported_changes(search, search.run(), true, false, settings_));
  } catch (const CannotIdentify& error) {
    out_.warnings.push_back("changes of the backlash of " + name + " are not judged: " + error.what());
  }
}

/// A mass scales with the torque constants.
void ArmChanges::add_scale() {
  const double common = arm_->fit().rig.common_error;
  if (common > 0 && std::any_of(chain_.begin(), chain_.end(),
                                [](const FoundChainChange& f) { return f.effect.values > 1; }))
    out_.warnings.push_back("the mass scales with the torque constants, which together are known to " +
                            to_text(std::round(1000 * common) / 10) +
                            " % (part of its error); a known weight measures them (identify --payload)");
}

Changes ArmChanges::run(const std::vector<arm::ArmRecord>& healthy, const arm::ArmRecord& record) {
  report(0, "fitting the healthy arm");
  arm_.emplace(rig_, healthy, settings_, progress_, out_.warnings);
  if (arm::holds_pose(record)) {
    report_pushes(record);
    return out_;
  }
  arm_->read(record, out_);
  search(record);
  for (const ArmJoint& joint : joints()) report_joint(joint);
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) report_deflection(j);
  for (const FoundChainChange& f : chain_) out_.changes.push_back(change_of(f));
  add_scale();
  std::sort(out_.changes.begin(), out_.changes.end(),
            [](const Change& a, const Change& b) { return a.since < b.since; });
  return out_;
}

}  // namespace

Changes detect_changes(const arm::ArmRig& rig, const std::vector<arm::ArmRecord>& healthy,
                       const arm::ArmRecord& record, const ChangeSettings& settings,
                       const Progress& progress) {
  return ArmChanges(rig, settings, progress).run(healthy, record);
}

}  // namespace backlash::changes
