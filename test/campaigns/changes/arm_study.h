// SPDX-License-Identifier: BSD-3-Clause
// How often a healthy arm is called changed, and how often a change of one is reported by its name and joint.
#pragma once

#include <cstdint>

namespace backlash::change_study {

/// `arms` of them healthy, and as many for each kind of change; `rate`: false alarms allowed per hour.
/// `rough`: noise is coloured, friction wanders and delays swing.
void study_arms(int arms, std::uint64_t seed, double rate, bool rough);

}  // namespace backlash::change_study
