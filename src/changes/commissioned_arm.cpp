// SPDX-License-Identifier: BSD-3-Clause
#include "commissioned_arm.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/arm/friction_turn.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::changes {
namespace {

arm::ArmFit fitted(const arm::ArmRig& rig, const std::vector<arm::ArmRecord>& healthy,
                   std::vector<std::string>& warnings) {
  std::vector<arm::ArmMotion> motions;
  for (const arm::ArmRecord& record : healthy)
    for (arm::ArmMotion& m : motions_of(record, rig, warnings)) motions.push_back(std::move(m));
  arm::ArmRig turned = rig;
  return arm::fit_arm_and_friction_turns(turned, motions);
}

}  // namespace

CommissionedArm::CommissionedArm(const arm::ArmRig& rig, const std::vector<arm::ArmRecord>& healthy,
                                 const ChangeSettings& settings, const Progress& progress,
                                 std::vector<std::string>& warnings)
    : rig_(rig), settings_(settings), progress_(progress), fit_(fitted(rig, healthy, warnings)) {
  for (const arm::ArmRecord& h : healthy)
    healthy_.push_back(chain_motion(fit_, h, {}, settings_.most_rate, warnings));
}

MotionSampling CommissionedArm::sampling_of_joint(std::size_t index) const {
  std::vector<const record::Record*> all = {&record_.joints[index]};
  for (const ChainMotion& h : healthy_) all.push_back(&h.joints[index]);
  MotionSampling sampling = sampling_of(all, settings_);
  sampling.chain = true;
  return sampling;
}

/// The healthy records in which this joint moves: it rests while others move.
std::vector<record::Record> CommissionedArm::long_enough(std::size_t index,
                                                         const MotionSampling& sampling) const {
  std::vector<record::Record> all;
  std::string why;
  for (const ChainMotion& h : healthy_) {
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

void CommissionedArm::add_joint(std::size_t index) {
  const MotionSampling sampling = sampling_of_joint(index);
  const std::vector<record::Record> of_joint = long_enough(index, sampling);
  HealthyModel model = commission_healthy(of_joint, sampling, settings_);
  SampledMotion motion = motion_by(model, record_.joints[index], settings_);
  ArmJoint& joint = joints_.emplace_back();
  joint.name = rig_.joints[index].name;
  joint.index = index;
  joint.model = std::move(model);
  joint.motion = std::move(motion);
  joint.scores.emplace(joint.model, settings_);
  set_chain_columns(record_, index, joint.motion);
  set_chain_inflation(joint);
  set_search(joint);
}

void CommissionedArm::set_chain_inflation(ArmJoint& joint) const {
  const std::vector<ChainEffect> effects = chain_effects(rig_.joints.size());
  const double variance = joint.model.noise * joint.model.noise;
  joint.chain_inflation.assign(effects.size(), 1);
  for (const ChainMotion& h : healthy_) {
    SampledMotion motion = motion_by(joint.model, h.joints[joint.index], settings_);
    set_chain_columns(h, joint.index, motion);
    const Eigen::VectorXd left = residual_of(joint.model, motion, settings_).residual;
    for (std::size_t e = 0; e < effects.size(); ++e)
      joint.chain_inflation[e] =
          std::max(joint.chain_inflation[e],
                   score_inflation(motion, left, *effect_columns(motion, effects[e].at_joint()), variance,
                                   settings_.window));
  }
}

void CommissionedArm::set_search(ArmJoint& joint) const {
  joint.search.emplace(joint.model, joint.motion, change_effects(joint.model.sampling), *joint.scores,
                       joint.beside, settings_, progress_);
}

void CommissionedArm::read(const arm::ArmRecord& record, Changes& out) {
  record_ = chain_motion(fit_, record, {}, settings_.most_rate, out.warnings);
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
    const std::string& name = rig_.joints[j].name;
    if (progress_ && !progress_(0.2 + 0.3 * double(j) / double(rig_.joints.size()), "commissioning " + name))
      throw Cancelled();
    try {
      add_joint(j);
    } catch (const CannotIdentify& error) {
      out.unjudged.push_back({name, error.what()});
    }
  }
  if (!joints_.empty()) return;
  std::vector<std::string> all;
  for (const Unjudged& u : out.unjudged) all.push_back(u.joint + ": " + u.why);
  throw CannotIdentify("no joint can be judged: " + joined(all));
}

/// What the arm carries loads its gears too, and in another position a joint bears another load.
void CommissionedArm::differ(const ChainDifference& difference, const arm::ArmRecord& record) {
  differences_.push_back(difference);
  std::vector<std::string> reported_before;
  record_ = chain_motion(fit_, record, differences_, settings_.most_rate, reported_before);
  for (ArmJoint& joint : joints_) {
    joint.motion = motion_by(joint.model, record_.joints[joint.index], settings_);
    set_chain_columns(record_, joint.index, joint.motion);
  }
}

std::optional<JointDeflection> CommissionedArm::deflection(std::size_t index) const {
  const record::Record& record = record_.joints[index];
  bool measured = record.has(record::Channel::load_position);
  for (const ChainMotion& h : healthy_)
    measured = measured && h.joints[index].has(record::Channel::load_position);
  if (!measured) return std::nullopt;
  MotionSampling sampling = sampling_of_joint(index);
  sampling.channel = ChangeChannel::deflection;
  double largest = 0;
  for (const ChainMotion& h : healthy_)
    for (const double torque : h.joints[index].column(record::Channel::output_torque))
      largest = std::max(largest, std::fabs(torque));
  sampling.mesh = MeshLoad();
  sampling.mesh->least = settings_.least_load * largest;
  HealthyModel model = commission_healthy(long_enough(index, sampling), sampling, settings_);
  SampledMotion motion = motion_by(model, record, settings_);
  return JointDeflection{std::move(model), std::move(motion)};
}

}  // namespace backlash::changes
