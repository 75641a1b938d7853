// SPDX-License-Identifier: BSD-3-Clause
// Where the integration of a motion is given up.
#pragma once

namespace backlash::simulation {

constexpr long kMaxStepsPerCall = 10'000'000;  // some seconds of work; a sample usually takes less than ten
inline const char* const kTooStiff =
    "too stiff for this method: a value of the rig file may be in another unit, or solver.method: bdf may do";

}  // namespace backlash::simulation
