// SPDX-License-Identifier: BSD-3-Clause
// A friction below zero, which drives: what a fit makes of it belongs to an effect that the model lacks.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "backlash_diagnosis/identification/effects/effect_search.h"
#include "backlash_diagnosis/signal/measured.h"
#include "hypothesis.h"
#include "search_settings.h"

namespace backlash::identification {

/// What a record holds of friction: rms speed of the motor [rad/s] and standard deviation of the torque [N
/// m].
struct MotionSize {
  double speed = 0, torque = 0;
};
MotionSize motion_size(const ServoData& record);

/// The friction that is below zero by the most of its standard errors, where they are `belief.least_z` and
/// its torque is worth saying; none where the machine is possible.
std::optional<Unexplained> impossible_friction(const std::map<std::string, signal::Measured>& fitted,
                                               const std::map<std::string, std::string>& units,
                                               const MotionSize& motion, const BeliefSettings& belief,
                                               const ExplainableSettings& settings);

}  // namespace backlash::identification
