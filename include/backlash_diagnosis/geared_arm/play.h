// SPDX-License-Identifier: BSD-3-Clause
// The play of each joint of an arm with two encoders, from ordinary motion of all of them. The flank on which
// the teeth of a joint rest follows from the load that the moving chain puts on them:
//
//   T = tau(q, v, a) + friction behind the gap,   phi = q_M - q = f + side b / 2 + g e(T) + s q + d v
//
// tau: the chain's torque at the joint (arm/dynamics.h), side: the sign of T where it is large for certain
// and stays so. f: offset of the encoders, s: their scale, d: their skew in time; errors up to three times
// per turn where the record shows them. Under small loads, where the side is not certain, e(T) is a law's: of
// a spring, of teeth that yield as a power of the load (Hertz 2/3), of springs that harden. All that the
// record does not rule out are in the interval. The motor's torque only shows whether the declared chain is
// the one that moved: beyond any friction of the motor it must agree with T.
//
// Interval, 95 %, root of the sum of squares of
// - scatter and laws of the deflection: Student t times the standard error, each stay on a flank counted as
//   one (sandwich estimator over stays, see diagnosis/flank_fit.h), by every law,
// - the friction behind the gap, as uncertain as it is large, over the stiffness, on both flanks; where the
//   file says less, 1 % of the largest load,
// - 2 % of the play, as position_difference where the deflection bends otherwise than any of them.
// Half of it beyond 15 % of the play: "cannot tell closer than". Teeth give way to the load: an encoder that
// does not follow its motor, or from flank to flank moves the other way, is no evidence.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/motion.h"
#include "backlash_diagnosis/diagnosis/estimate.h"

namespace backlash::geared_arm {

/// What is known of a joint beside the chain; its play is not.
struct JointLoad {
  double link_coulomb = 0;  // N m
  double link_viscous = 0;  // N m s/rad
};

struct PlaySettings {
  double least_load = 0.1;  // of the largest |T|, beyond friction: below it the side is not certain. Choice:
                            // what a payload that nobody declared may change
  double least_friction = 0.01;  // of the largest |T|: friction behind the gap that nobody declared; choice
  double settle = 1.5;  // cycles of torque_cutoff that a low-pass smears a change of flank over; choice
  std::size_t least_stays = 3;  // on each flank, for a standard error that means something; choice
  double disagreement = 0.1;    // beyond it the chain is not the one that moved; choice, see doc/arm.md
  double bend = 0.02;           // of the play, see above
  double vague = 0.15;  // half width of the interval, of the play, beyond which no play is reported; choice
  double worst_residual = 0.2;  // of the play: beyond it the teeth do not rest on their flanks; choice
};

struct JointPlay {
  std::string joint;
  diagnosis::Estimate estimate;                   // position_difference
  double least_torque = 0, largest_torque = 0;    // N m, T over the record
  double lower_position = 0, upper_position = 0;  // rad, of the joint
  double fastest = 0;                             // rad/s
  double disagreement = 0;        // of the motor's torque and the chain's, relative, rms, friction aside
  std::size_t stays[2] = {0, 0};  // on the negative and the positive flank
  std::string one_flank;          // why the load shows no play, for people; empty: it presses both flanks
  std::optional<double> pose;  // rad, of this joint, the others as they were on average: where gravity would
                               // turn the load that never turned
};

/// One per joint of the rig. Throws BadData as arm::motions_of().
std::vector<JointPlay> plays_of(const arm::ArmRig& rig, const std::vector<JointLoad>& loads,
                                const arm::ArmRecord& record, std::vector<std::string>& warnings,
                                const PlaySettings& settings = {});

}  // namespace backlash::geared_arm
