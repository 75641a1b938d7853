// SPDX-License-Identifier: BSD-3-Clause
// Torques of an arm along a motion, and the loads that its limits and gravity allow.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "backlash_diagnosis/geared_arm/motion_plan.h"
#include "base_information.h"

namespace backlash::geared_arm {

/// From `from` to `to` [s] every `step` [s].
JointMotions sampled_motion(const std::vector<simulation::FourierMotion>& series, double from, double to,
                            double step);

/// A row per time, a column per joint [N m].
struct MotionTorques {
  Eigen::MatrixXd mesh;   // T: the chain and the friction behind the gap
  Eigen::MatrixXd motor;  // what the motor gives for it
};
MotionTorques torques_of(const GearedArm& arm, const arm::Chain& chain, const JointMotions& motion);

/// reach[j][0, 1]: the largest -T and T of joint j that poses and motions within the limits were found to
/// give.
std::vector<std::array<double, 2>> reachable_loads(const GearedArm& arm, const arm::Chain& chain,
                                                   const std::vector<MotionLimits>& limits,
                                                   std::uint64_t seed);

/// Where gravity keeps joint j on one flank; `least` [N m]: the load that is certain, beyond friction.
std::vector<HiddenRange> hidden_ranges(const arm::Chain& chain, const std::vector<MotionLimits>& limits,
                                       const arm::Joints& others, std::size_t joint, double least);

}  // namespace backlash::geared_arm
