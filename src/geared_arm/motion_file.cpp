// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/motion_file.h"

#include <fmt/format.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/yaml_reader.h"
#include "motion_loads.h"

namespace backlash::geared_arm {
namespace {

constexpr int kSchema = 1;
const Range kRate = {1, 1e5, false};  // Hz; choice

std::string list(const std::vector<double>& values) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(to_text(value));
  return "[" + joined(texts) + "]";
}

std::string figure(double value) {
  return std::isfinite(value) ? fmt::format("{:.5g}", value) : "null";
}

std::string gap_text(const JointPlan& joint) {
  if (!joint.gap) return "";
  std::string text = fmt::format(
      "    mesh_torque: [{:.5g}, {:.5g}]    # N m\n    certain: {:.5g}    # N m: beyond it the flank is "
      "certain\n"
      "    stays: [{}, {}]    # per period, on the negative and the positive flank\n"
      "    reach: [{:.5g}, {:.5g}]    # N m, the most that the limits allow\n    gap: {}\n    hidden: [",
      joint.least_load, joint.largest_load, joint.certain, joint.stays[0], joint.stays[1], -joint.reach[0],
      joint.reach[1], to_string(joint.view));
  std::vector<std::string> ranges;
  for (const HiddenRange& range : joint.hidden)
    ranges.push_back(fmt::format("[{:.4f}, {:.4f}, {}]", range.lower, range.upper, range.flank));
  return text + joined(ranges) + "]    # rad, rad, flank on which gravity holds it\n    message: \"" +
         joint.message + "\"\n";
}

std::string joint_text(const JointPlan& joint) {
  const simulation::FourierMotion& m = joint.motion;
  return fmt::format(
             "  - name: {}\n    start: {}    # rad\n    offset: {}    # rad\n    cosines: {}    # rad\n"
             "    sines: {}    # rad\n    position: [{:.5g}, {:.5g}]    # rad, of all that follows the "
             "largest\n"
             "    speed: {:.5g}    # rad/s\n    acceleration: {:.5g}    # rad/s^2\n    torque: {:.5g}    # N "
             "m\n",
             joint.joint, to_text(m.start), to_text(m.offset), list(m.cosines), list(m.sines), joint.lower,
             joint.upper, joint.speed, joint.acceleration, joint.torque) +
         gap_text(joint);
}

}  // namespace

std::string motion_text(const MotionPlan& plan) {
  const simulation::FourierMotion& first = plan.joints.front().motion;
  std::string text = fmt::format(
      "# A motion that plan_motion has planned. Of each joint, s seconds after the approach:\n"
      "#   offset + sum over k = 1, 2, ... of cosines[k] cos(2 pi k s / period) + sines[k] sin(2 pi k s / "
      "period)\n"
      "# Before, from rest at start: start + (q(approach) - start) (10 x^3 - 15 x^4 + 6 x^5), x = t / "
      "approach\n"
      "# SPDX-License-Identifier: BSD-3-Clause\n"
      "schema_version: {}\nrig: {}\nseed: {}\napproach: {}    # s\nperiod: {}    # s, each from rest to "
      "rest\n",
      kSchema, plan.rig, plan.settings.seed, to_text(first.approach), to_text(first.period));
  text += fmt::format(
      "information:\n  base_parameters: {}\n  noise: {}    # of the torques\n  condition: {}\n"
      "  reference_condition: {}    # of the best of {} random motions\n"
      "  gain: {}    # how much smaller standard errors are than by that one\njoints:\n",
      plan.base_parameters, plan.noise_known ? "declared" : "by_torque_limits",
      figure(plan.planned.condition), figure(plan.reference.condition), plan.settings.motions,
      figure(plan.gain));
  for (const JointPlan& joint : plan.joints) text += joint_text(joint);
  return text;
}

PlannedMotion read_motion(const std::string& path) {
  const YamlReader yaml = YamlReader::from_file(path);
  yaml.integer("schema_version", kSchema, kSchema);
  PlannedMotion motion;
  motion.source = path;
  motion.rig = yaml.text("rig");
  for (const YamlReader& joint : yaml.maps("joints")) {
    motion.joints.push_back(joint.text("name"));
    simulation::FourierMotion m;
    m.approach = yaml.number("approach", Range::not_negative());
    m.period = yaml.number("period", Range::positive());
    m.start = joint.number("start", Range::any());
    m.offset = joint.number("offset", Range::any());
    m.cosines = joint.numbers("cosines", Range::any());
    m.sines = joint.numbers("sines", Range::any());
    try {
      simulation::check(m);
    } catch (const InvalidParameter& error) {
      joint.fail("name", error.what());
    }
    motion.motions.push_back(m);
  }
  return motion;
}

void follow(GearedArm& arm, const PlannedMotion& motion) {
  if (motion.joints != arm.rig.joint_names())
    throw BadData(motion.source, "joints " + joined(motion.joints) + ": the arm '" + arm.rig.name + "' has " +
                                     joined(arm.rig.joint_names()));
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    GearedJoint& joint = arm.joints[j];
    if (joint.held) continue;
    if (joint.excitation.type != "moves")
      throw BadData(arm.rig.source, "joint '" + motion.joints[j] +
                                        "': excitation.type = " + joint.excitation.type +
                                        ": only the position loop of moves can follow a motion");
    joint.excitation.type = "fourier";
    joint.excitation.fourier = motion.motions[j];
    joint.start = motion.motions[j].start;
  }
}

std::string trajectory_csv(const GearedArm& arm, const MotionPlan& plan, double rate) {
  if (!kRate.contains(rate)) throw InvalidParameter("rate", rate, kRate.text());
  std::string text = "time";
  for (const JointPlan& joint : plan.joints)
    for (const char* column :
         {"reference_position", "reference_velocity", "reference_acceleration", "mesh_torque"})
      text += fmt::format(",{}/{}", joint.joint, column);
  text += '\n';
  std::vector<simulation::FourierMotion> series;
  for (const JointPlan& joint : plan.joints) series.push_back(joint.motion);
  const JointMotions motion =
      sampled_motion(series, 0, series.front().approach + series.front().period, 1 / rate);
  const Eigen::MatrixXd mesh = torques_of(arm, arm::loaded_chain(arm.rig), motion).mesh;
  for (Eigen::Index i = 0; i < mesh.rows(); ++i) {
    text += to_text(double(i) / rate);
    for (Eigen::Index j = 0; j < mesh.cols(); ++j)
      text += fmt::format(",{:.9g},{:.9g},{:.9g},{:.6g}", motion.q(i, j), motion.v(i, j), motion.a(i, j),
                          mesh(i, j));
    text += '\n';
  }
  return text;
}

}  // namespace backlash::geared_arm
