// SPDX-License-Identifier: BSD-3-Clause
// Effects of one joint in records of an arm: their columns, and the search for them.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/arm/fit.h"
#include "backlash_diagnosis/arm/joint_effect.h"
#include "backlash_diagnosis/arm/motion.h"

namespace backlash::arm {

/// Null: it is none of a joint of an arm.
const JointEffectSpec* known_spec(const std::string& id);

/// Whether its column is the torque of another joint's drive.
bool is_coupling(const JointEffect& effect);

bool stands_for(const JointEffectSpec& spec, DriveTerm term);
/// Whether the drives of the rig have it as a term.
bool stands_for_term(const JointEffectSpec& spec, const ArmRig& rig);

/// Whose column is the torque of its own drive.
JointEffect gain_of_drive();
bool is_gain(const JointEffect& effect);

/// Whether its column is the torque of a drive: of its own, or of another joint's.
bool is_of_drives(const JointEffect& effect);

/// Torque that one unit of each value takes, N m, at all samples, not filtered; not of is_of_drives().
/// `load`: the chain's own torque at the joint.
Eigen::MatrixXd effect_columns(const JointEffect& effect, const ArmMotion& motion, std::size_t joint,
                               const Eigen::VectorXd& load);

/// An effect that the residual of a joint may be, with values to start from.
struct EffectGuess {
  FreeEffect effect;
  double share = 0;                // of the joint's squared residual that it would take away
  std::vector<std::string> alike;  // other effects there that take nearly as much
};

/// The best guess of each effect and joint, the largest share first, of what the fit leaves in `motions`.
/// `everywhere`: those are all that links and drives are fitted to.
std::vector<EffectGuess> guess_effects(const ArmFit& fit, const FitFreedom& freedom,
                                       const std::vector<FittedMotion>& motions, bool everywhere);

/// Of each joint's squared residual in `motions`, what another gain of its motor there would take away.
std::vector<double> gain_shares(const ArmFit& fit, const FitFreedom& freedom,
                                const std::vector<FittedMotion>& motions);

}  // namespace backlash::arm
