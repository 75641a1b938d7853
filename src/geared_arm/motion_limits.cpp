// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/motion_limits.h"

#include <fmt/format.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::geared_arm {
namespace {

const char* const kSection = "motion_limits";

/// One limit: the file's within what the URDF allows, else the URDF's.
double limit(const YamlReader& joint, const std::optional<YamlReader>& section, const std::string& key,
             const Range& allowed, double urdf, const std::string& urdf_key) {
  if (section && section->has(key)) return section->number(key, allowed);
  if (!std::isfinite(urdf))
    joint.fail("name", fmt::format("no limit of the {}: neither {}.{} here nor <limit {}> in the URDF", key,
                                   kSection, key, urdf_key));
  return urdf;
}

Range up_to(double most) {
  Range range = Range::positive();
  if (std::isfinite(most)) range.upper = most;
  return range;
}

double acceleration_limit(const YamlReader& joint, const std::optional<YamlReader>& section,
                          std::optional<double> absent) {
  if (section && section->has("acceleration")) return section->number("acceleration", Range::positive());
  if (!absent)
    joint.fail("name", fmt::format("no limit of the acceleration: a URDF has none, {}.acceleration here or "
                                   "--acceleration [rad/s^2] must say it",
                                   kSection));
  return *absent;
}

MotionLimits read_joint(const YamlReader& joint, const arm::JointLimits& urdf, std::optional<double> held,
                        std::optional<double> acceleration) {
  const auto section = joint.optional_map(kSection);
  MotionLimits m;
  const Range within = std::isfinite(urdf.lower) ? Range::between(urdf.lower, urdf.upper) : Range::any();
  m.lower = limit(joint, section, "lower", within, urdf.lower, "lower");
  m.upper = limit(joint, section, "upper", within, urdf.upper, "upper");
  if (!(m.lower < m.upper)) section->fail("upper", fmt::format("must be > lower = {}", m.lower));
  m.speed = limit(joint, section, "speed", up_to(urdf.velocity), urdf.velocity, "velocity");
  m.torque = limit(joint, section, "torque", up_to(urdf.effort), urdf.effort, "effort");
  m.acceleration = acceleration_limit(joint, section, acceleration);
  if (section && section->has("start")) m.start = section->number("start", Range::any());
  if (held) m.start = *held;
  if (m.start < m.lower || m.start > m.upper)
    joint.fail("name", fmt::format("starts at {} rad, outside its limits {} to {} rad: {}.start", m.start,
                                   m.lower, m.upper, kSection));
  if (held) m.lower = m.upper = m.start;
  if (section) section->finish();
  return m;
}

}  // namespace

std::vector<MotionLimits> load_motion_limits(const GearedArm& arm, std::optional<double> acceleration) {
  const std::vector<YamlReader> joints = YamlReader::from_text(arm.rig.text, arm.rig.source).maps("joints");
  const std::vector<arm::JointLimits> urdf = arm::read_limits(arm.rig.urdf, arm.rig.joint_names());
  std::vector<MotionLimits> all;
  for (std::size_t j = 0; j < joints.size(); ++j)
    all.push_back(read_joint(joints[j], urdf[j], arm.joints[j].held, acceleration));
  return all;
}

}  // namespace backlash::geared_arm
