// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/changes/arm_changes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <deque>

#include "backlash_diagnosis/arm/fit.h"
#include "backlash_diagnosis/arm/push.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "chain_search.h"
#include "channel_changes.h"

namespace backlash::changes {
namespace {

class ArmChanges {
 public:
  ArmChanges(const arm::ArmRig& rig, const ChangeSettings& settings, const Progress& progress)
      : rig_(rig), settings_(settings), progress_(progress) {
    settings_.cutoff = rig.identification.torque_cutoff;
    settings_.position_cutoff = rig.identification.kinematics_cutoff;
    // The joints share the rate, with two channels each, and the chain is one more.
    settings_.false_alarms_per_hour /= double(2 * rig.joints.size() + 1);
  }

  Changes run(const std::vector<arm::ArmRecord>& healthy, const arm::ArmRecord& record);

 private:
  void tell(double share, const std::string& phase) const {
    if (progress_ && !progress_(share, phase)) throw Cancelled();
  }
  void fit(const std::vector<arm::ArmRecord>& healthy);
  void tell_pushes(const arm::ArmRecord& record);
  void read(const std::vector<arm::ArmRecord>& healthy, const arm::ArmRecord& record);
  void add_joint(std::size_t index);
  MotionSampling sampling_of_joint(std::size_t index) const;
  std::vector<record::Record> long_enough(std::size_t index, const MotionSampling& sampling) const;
  void search_deflection(std::size_t index);
  void add(const std::string& joint, const Changes& one, const ChangeSearch& search,
           const HealthyModel& model);
  void set_search(ArmJoint& joint) const;
  void search(const arm::ArmRecord& record);
  void take(const FoundChainChange& found, const arm::ArmRecord& record);
  void differ(const FoundChainChange& found, bool from_beginning, const arm::ArmRecord& record);
  void tell_apart(FoundChainChange& of_chain, const ArmJoint& joint, FoundChange& own) const;
  bool is_of_chain(const ArmJoint& joint, std::size_t place, const FoundChange& next) const;
  void add_constant_error(const ArmJoint& joint, Change& change) const;
  bool is_left_by_chain(const ArmJoint& joint, std::size_t place, const Change& change) const;
  void tell_joint(const ArmJoint& joint, std::size_t place);
  Change told(const FoundChainChange& f) const;

  const arm::ArmRig& rig_;
  ChangeSettings settings_;
  const Progress& progress_;
  arm::ArmFit healthy_;
  std::vector<ChainMotion> healthy_motions_;
  ChainMotion record_;  // with what the chain was found to be another by
  std::deque<ArmJoint> joints_;
  std::vector<FoundChainChange> chain_;    // told
  std::vector<FoundChainChange> earlier_;  // and those that the record has from its beginning
  std::vector<ChainDifference> differences_;
  Changes out_;
};

void ArmChanges::fit(const std::vector<arm::ArmRecord>& healthy) {
  std::vector<arm::ArmMotion> motions;
  for (const arm::ArmRecord& record : healthy)
    for (arm::ArmMotion& m : motions_of(record, rig_, out_.warnings)) motions.push_back(std::move(m));
  std::vector<arm::FittedMotion> fitted;
  for (const arm::ArmMotion& m : motions) fitted.push_back({&m, false});
  healthy_ = arm::fit_arm(rig_, fitted);
}

void ArmChanges::tell_pushes(const arm::ArmRecord& record) {
  const arm::PushSettings settings;
  for (const arm::PushEvent& e : arm::pushes(record, healthy_.rig, settings)) {
    Change change;
    change.effect = "external_torque";
    change.joint = rig_.joints[e.joint].name;
    change.since = e.begin;
    change.since_from = e.earliest;
    change.since_to = e.begin + settings_.onset_least;
    if (e.released) change.until = e.end;
    change.gain = e.clear * e.clear;
    change.size.push_back({"torque", "N m", {-e.torque, e.torque_error}});
    out_.changes.push_back(change);
  }
  const std::vector<double>& time = record.joints.front().time;
  out_.windows = static_cast<std::size_t>((time.back() - time.front()) / settings_.window);
  out_.warnings.emplace_back(
      "the record holds its pose: friction at rest hides what the drives carry, so pushes are looked for and "
      "nothing else");
}

MotionSampling ArmChanges::sampling_of_joint(std::size_t index) const {
  std::vector<const record::Record*> all = {&record_.joints[index]};
  for (const ChainMotion& h : healthy_motions_) all.push_back(&h.joints[index]);
  MotionSampling sampling = sampling_of(all, settings_);
  sampling.chain = true;
  return sampling;
}

/// A joint rests while others move: the healthy records in which it moves.
std::vector<record::Record> ArmChanges::long_enough(std::size_t index, const MotionSampling& sampling) const {
  std::vector<record::Record> all;
  std::string why;
  for (const ChainMotion& h : healthy_motions_) {
    try {
      sampled_motion(h.joints[index], sampling, settings_);
      all.push_back(h.joints[index]);
    } catch (const CannotIdentify& error) {
      why = error.what();
    }
  }
  if (all.empty()) throw CannotIdentify(why);
  return all;
}

void ArmChanges::add_joint(std::size_t index) {
  const std::string& name = rig_.joints[index].name;
  std::vector<record::Record> of_joint;
  try {
    const MotionSampling sampling = sampling_of_joint(index);
    of_joint = long_enough(index, sampling);
    HealthyModel model = commission_healthy(of_joint, sampling, settings_);
    SampledMotion motion = motion_by(model, record_.joints[index], settings_);
    joints_.emplace_back();
    ArmJoint& joint = joints_.back();
    joint.name = name;
    joint.index = index;
    joint.model = std::move(model);
    joint.motion = std::move(motion);
  } catch (const CannotIdentify& error) {
    out_.warnings.push_back(name + " is not judged: " + error.what());
    return;
  }
  ArmJoint& joint = joints_.back();
  joint.scores.emplace(joint.model, settings_);
  set_chain_columns(record_, index, joint.motion);
  const std::vector<ChainEffect> effects = chain_effects(rig_.joints.size());
  joint.chain_inflation.assign(effects.size(), 1);
  for (const ChainMotion& h : healthy_motions_) {
    SampledMotion motion = motion_by(joint.model, h.joints[index], settings_);
    set_chain_columns(h, index, motion);
    const Eigen::VectorXd left = left_of(joint.model, motion, settings_);
    for (std::size_t e = 0; e < effects.size(); ++e)
      joint.chain_inflation[e] =
          std::max(joint.chain_inflation[e],
                   score_inflation(motion, left, *effect_columns(motion, effects[e].at_joint()),
                                   joint.model.noise * joint.model.noise, settings_.window));
  }
  set_search(joint);
}

void ArmChanges::set_search(ArmJoint& joint) const {
  joint.search.emplace(
      joint.model, joint.motion, change_effects(joint.model.sampling),
      [scores = &*joint.scores](const ChangeEffect& e) { return scores->inflation(e); }, joint.beside,
      settings_, progress_);
}

/// With a second encoder behind the gap: the deflection of each joint under the load that the chain puts on
/// its teeth.
void ArmChanges::search_deflection(std::size_t index) {
  const record::Record& record = record_.joints[index];
  bool measured = record.has(record::Channel::load_position);
  for (const ChainMotion& h : healthy_motions_)
    measured = measured && h.joints[index].has(record::Channel::load_position);
  if (!measured) return;
  MotionSampling sampling = sampling_of_joint(index);
  sampling.channel = ChangeChannel::deflection;
  double largest = 0;
  for (const ChainMotion& h : healthy_motions_)
    for (const double torque : h.joints[index].column(record::Channel::output_torque))
      largest = std::max(largest, std::fabs(torque));
  sampling.mesh = MeshLoad();
  sampling.mesh->least = settings_.least_load * largest;
  const std::string& name = rig_.joints[index].name;
  try {
    const std::vector<record::Record> healthy = long_enough(index, sampling);
    const HealthyModel model = commission_healthy(healthy, sampling, settings_);
    const SampledMotion motion = motion_by(model, record, settings_);
    const HealthyScores scores(model, settings_);
    ChangeSearch search(
        model, motion, change_effects(sampling),
        [&](const ChangeEffect& e) { return scores.inflation(e); }, {}, settings_, progress_);
    const std::vector<FoundChange> found = search.run();
    Changes one;
    for (const FoundChange& f : found) one.changes.push_back(search.told(f, found, false));
    tell_unexplained(search, found, true, settings_, one);
    take_out_short(settings_, one);
    add(name, one, search, model);
  } catch (const CannotIdentify& error) {
    out_.warnings.push_back("changes of the backlash of " + name + " cannot be told: " + error.what());
  }
}

void ArmChanges::read(const std::vector<arm::ArmRecord>& healthy, const arm::ArmRecord& record) {
  for (const arm::ArmRecord& h : healthy)
    healthy_motions_.push_back(chain_motion(healthy_, h, {}, settings_.most_rate, out_.warnings));
  record_ = chain_motion(healthy_, record, {}, settings_.most_rate, out_.warnings);
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
    tell(0.2 + 0.3 * double(j) / double(rig_.joints.size()), "commissioning " + rig_.joints[j].name);
    add_joint(j);
  }
  if (joints_.empty()) throw CannotIdentify(joined(out_.warnings));
}

/// What the arm carries loads its gears too, and a joint that stands elsewhere bears another load.
void ArmChanges::differ(const FoundChainChange& found, bool from_beginning, const arm::ArmRecord& record) {
  const double start = joints_.front().motion.start, end = record.joints.front().time.back();
  const bool to_end = found.to == joints_.front().search->blocks();
  ChainDifference d;
  d.joint = found.effect.joint;
  d.from = from_beginning ? start : start + settings_.block * double(found.from);
  d.to = to_end ? end + 1 : start + settings_.block * double(found.to);
  if (found.effect.values > 1)
    d.body = found.score.values;
  else
    d.slip = found.score.values[0];
  differences_.push_back(d);
  std::vector<std::string> told_before;
  record_ = chain_motion(healthy_, record, differences_, settings_.most_rate, told_before);
  for (ArmJoint& joint : joints_) {
    joint.motion = motion_by(joint.model, record_.joints[joint.index], settings_);
    set_chain_columns(record_, joint.index, joint.motion);
  }
}

/// A change of the chain stands beside those of each joint from then on.
void ArmChanges::take(const FoundChainChange& found, const arm::ArmRecord& record) {
  const bool from_beginning = found.low <= 0;
  differ(found, from_beginning, record);
  std::size_t j = 0;
  for (ArmJoint& joint : joints_) {
    FoundChange beside{found.effect.at_joint(), found.from, found.to, {}, found.inflation, 0, {}};
    beside.gain = found.shares[j++];
    if (from_beginning) beside.from = 0;
    if (from_beginning && found.to == joint.search->blocks()) ++beside.to;
    joint.beside.push_back(beside);
    set_search(joint);
  }
  earlier_.push_back(found);
  if (!from_beginning) {
    chain_.push_back(found);
    return;
  }
  const std::string name = described(found.effect, rig_.chain);
  out_.different.push_back(name);
  out_.warnings.push_back("from its beginning the record differs from the healthy ones by " + name +
                          ": that is no change within it");
}

/// Each is named beside the other where both explain it alike.
void ArmChanges::tell_apart(FoundChainChange& of_chain, const ArmJoint& joint, FoundChange& own) const {
  const double x = of_chain.score.gain, y = own.score.gain;
  const double apart = std::fabs(double(of_chain.from) - double(own.from)) * settings_.block;
  if (std::min(x, y) < settings_.alike * std::max(x, y) || apart > settings_.same_event) return;
  of_chain.alike.push_back(own.effect.id + " of " + joint.name);
  own.alike.push_back(described(of_chain.effect, rig_.chain));
}

/// Whether it is what a change of the chain leaves in a joint: more load rubs more, and shapes are
/// idealisations.
bool ArmChanges::is_of_chain(const ArmJoint& joint, std::size_t place, const FoundChange& next) const {
  const Change change = joint.search->told(next, joint.found, false);
  const double start = joint.motion.start;
  return std::any_of(chain_.begin(), chain_.end(), [&](const FoundChainChange& f) {
    const bool together = change.since_from - settings_.same_event <= start + f.high &&
                          start + f.low - settings_.same_event <= change.since_to;
    const bool within = next.from >= f.from && next.from < f.to;
    const double least = together ? settings_.least_beside : within ? settings_.least_further : 0;
    return next.score.gain < least * f.shares[place];
  });
}

/// The clearest first, be it of one joint or of the chain; then what it leaves.
void ArmChanges::search(const arm::ArmRecord& record) {
  std::vector<std::optional<FoundChange>> next(joints_.size());
  std::vector<char> stale(joints_.size(), 1);
  for (int round = 0; round < settings_.most_changes * static_cast<int>(joints_.size()); ++round) {
    std::size_t clearest = joints_.size();
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      ArmJoint& joint = joints_[j];
      const bool full = joint.found.size() >= static_cast<std::size_t>(settings_.most_changes);
      if (stale[j]) next[j] = full ? std::nullopt : joint.search->next(joint.found);
      stale[j] = 0;
      if (next[j] && (clearest == joints_.size() || next[j]->score.gain > next[clearest]->score.gain))
        clearest = j;
    }
    std::optional<FoundChainChange> of_chain;
    if (earlier_.size() < static_cast<std::size_t>(settings_.most_changes))
      of_chain = ChainSearch(joints_, rig_.chain, settings_).best(earlier_);
    if (of_chain && clearest < joints_.size()) tell_apart(*of_chain, joints_[clearest], *next[clearest]);
    if (of_chain && (clearest == joints_.size() || of_chain->score.gain > next[clearest]->score.gain)) {
      take(*of_chain, record);
      stale.assign(joints_.size(), 1);
    } else if (clearest < joints_.size()) {
      ArmJoint& joint = joints_[clearest];
      if (is_of_chain(joint, clearest, *next[clearest])) {
        joint.beside.push_back(*next[clearest]);
        set_search(joint);
      } else {
        joint.search->add(*next[clearest], joint.found);
      }
      stale[clearest] = 1;
    } else {
      return;
    }
  }
}

/// What no effect explains, where it is small beside a change of the chain: teeth ring and cross the gap
/// otherwise under another load.
bool ArmChanges::is_left_by_chain(const ArmJoint& joint, std::size_t place, const Change& change) const {
  const double noise = joint.model.noise;
  return change.effect == "unknown" &&
         std::any_of(chain_.begin(), chain_.end(), [&](const FoundChainChange& f) {
           const double from = joint.motion.start + f.low, rows = double(joint.motion.size());
           const double explained = f.shares[place] * noise * noise / rows;  // mean square, at least
           return change.since >= from - settings_.window &&
                  change.error_after * change.error_after < settings_.least_explained * explained;
         });
}

/// What one channel of a joint shows.
void ArmChanges::add(const std::string& joint, const Changes& one, const ChangeSearch& search,
                     const HealthyModel& model) {
  const auto named = [&](const std::string& text) { return joint + ": " + text; };
  for (const Change& c : one.changes) {
    out_.changes.push_back(c);
    out_.changes.back().joint = joint;
  }
  for (const std::string& warning : one.warnings) out_.warnings.push_back(named(warning));
  for (const std::string& name : search.different()) {
    out_.different.push_back(named(name));
    out_.warnings.push_back(named("from its beginning the record differs from the healthy ones by " + name +
                                  ": that is no change within it"));
  }
  for (const ChangeEffect& e : model.further) out_.healthy_terms.push_back(named(e.name()));
  if (!one.cannot_tell.empty())
    out_.cannot_tell += (out_.cannot_tell.empty() ? "" : "; ") + named(one.cannot_tell);
}

/// Torques are as well known as the constants that they follow from.
void ArmChanges::add_constant_error(const ArmJoint& joint, Change& change) const {
  const double relative =
      std::hypot(healthy_.rig.common_error, healthy_.rig.joints[joint.index].constant_error);
  for (ChangeSize& s : change.size)
    if (s.name != "phase" && s.name != "order" && s.unit.find("N m") != std::string::npos)
      s.measured.standard_error = std::hypot(s.measured.standard_error, relative * s.measured.value);
}

void ArmChanges::tell_joint(const ArmJoint& joint, std::size_t place) {
  Changes one;
  for (const FoundChange& f : joint.found) one.changes.push_back(joint.search->told(f, joint.found, false));
  tell_unexplained(*joint.search, joint.found, false, settings_, one);
  take_out_short(settings_, one);
  std::vector<Change> kept;
  for (Change& c : one.changes) {
    add_constant_error(joint, c);
    if (may_be_external_torque(c.effect)) c.alike.emplace_back("external_torque");
    if (is_left_by_chain(joint, place, c))
      one.warnings.push_back("since " + to_text(std::round(c.since)) +
                             " s the record follows no effect, beside " +
                             described(chain_.front().effect, rig_.chain));
    else
      kept.push_back(c);
  }
  one.changes = std::move(kept);
  add(joint.name, one, *joint.search, joint.model);
  out_.windows = std::max(out_.windows, joint.search->windows());
  out_.threshold = joint.search->threshold(1);
  out_.noise = std::max(out_.noise, joint.model.noise);
}

Change ArmChanges::told(const FoundChainChange& f) const {
  Change change;
  change.effect = f.effect.id;
  const arm::Joint& joint = rig_.chain.joints[f.effect.joint];
  change.joint = joint.name;
  const double start = joints_.front().motion.start;
  change.since = start + settings_.block * double(f.from);
  change.since_from = start + f.low;
  change.since_to = start + f.high;
  if (f.to < joints_.front().search->blocks()) change.until = start + settings_.block * double(f.to);
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
  const double mass_error = std::hypot(std::sqrt(c(0, 0)), x[0] * healthy_.rig.common_error);
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

Changes ArmChanges::run(const std::vector<arm::ArmRecord>& healthy, const arm::ArmRecord& record) {
  tell(0, "fitting the healthy arm");
  fit(healthy);
  tell(0.2, "reading the motion");
  if (arm::holds_pose(record)) {
    tell_pushes(record);
    return out_;
  }
  read(healthy, record);
  search(record);
  for (std::size_t j = 0; j < joints_.size(); ++j) tell_joint(joints_[j], j);
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) search_deflection(j);
  for (const FoundChainChange& f : chain_) out_.changes.push_back(told(f));
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
