// SPDX-License-Identifier: BSD-3-Clause
// Within which speed dry friction of a drive turns its sign: v_0 of arm_rig.h, estimated from records.
//
// Of a v_0 that is not the machine's, c (S' - S) is left about each reversal, c being Coulomb friction. Other
// effects of low speed have nearly that shape: exp(-(v / w_s)^2) S with w_s near v_0 passes for it, so that
// Stribeck's friction would be named, three times as large as all that is missing.
#pragma once

#include <vector>

#include "backlash_diagnosis/arm/fit.h"

namespace backlash::arm {

/// v_0 [rad/s] of each joint: the octave about the rig's that leaves least of its torque, each drive's terms
/// fitted anew beside it (one step of Newton; links as they are), where that is less by kClearly and less in
/// every motion; else the rig's. `fit`: of these motions, without effects; they are afterwards as before.
std::vector<double> friction_speeds(const ArmFit& fit, std::vector<ArmMotion>& motions);

/// fit_arm() of all that it may change, and where a v_0 is another one than the rig has, once more with that:
/// `rig` and `motions` then have it, and the fit's warnings say so. Throws as fit_arm().
ArmFit fit_arm_and_friction_speeds(ArmRig& rig, std::vector<ArmMotion>& motions,
                                   const FitSettings& settings = {}, const Progress& progress = nullptr);

}  // namespace backlash::arm
