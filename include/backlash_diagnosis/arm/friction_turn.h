// SPDX-License-Identifier: BSD-3-Clause
// How dry friction of a drive turns its sign at a reversal, estimated from records: within v_0 of arm_rig.h,
// and where that shows over a path x_s of the bristles of its teeth and bearings (Dahl, see
// model/presliding.h).
//
// Of a v_0 that is not the machine's, c (S' - S) is left about each reversal, c being Coulomb friction. Other
// effects of low speed have nearly that shape: exp(-(v / w_s)^2) S with w_s near v_0 passes for it, so that
// Stribeck's friction would be named, three times as large as all that is missing.
#pragma once

#include <vector>

#include "backlash_diagnosis/arm/fit.h"

namespace backlash::arm {

struct FrictionTurn {
  double speed = 0;     // v_0, rad/s
  double distance = 0;  // x_s, rad; 0: at once
};

/// Of each joint: an octave about the rig's v_0, or a path, the one that leaves least of its torque, terms
/// and delay of each drive fitted anew beside it (one step of Newton; links as they are), where that is less
/// by more than scatter; else the rig's. `fit`: of these motions, without effects; they are afterwards as
/// before.
std::vector<FrictionTurn> friction_turns(const ArmFit& fit, std::vector<ArmMotion>& motions,
                                         const FitSettings& settings = {});

/// fit_arm() of all that it may change, and where friction turns otherwise than the rig says, once more with
/// that: `rig` and `motions` then have it, and the fit's warnings say so. Throws as fit_arm().
ArmFit fit_arm_and_friction_turns(ArmRig& rig, std::vector<ArmMotion>& motions,
                                  const FitSettings& settings = {}, const Progress& progress = nullptr);

}  // namespace backlash::arm
