// SPDX-License-Identifier: BSD-3-Clause
// A negative friction would drive the machine. If a fit finds one, the model lacks an effect.
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

/// The friction that is negative by most standard errors, if by at least `belief.least_z` of them and if its
/// torque is not negligible; none otherwise.
std::optional<Unexplained> impossible_friction(const std::map<std::string, signal::Measured>& fitted,
                                               const std::map<std::string, std::string>& units,
                                               const MotionSize& motion, const BeliefSettings& belief,
                                               const ExplainableSettings& settings);

}  // namespace backlash::identification
