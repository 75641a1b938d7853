// SPDX-License-Identifier: BSD-3-Clause
// The play of each joint of an arm with one encoder per joint, on the motor's side of its gap, from ordinary
// motion of all joints. Where the load that the chain puts on the teeth of a joint turns, the link leaves one
// flank and coasts, as gravity and the other joints would have it, while the motor carries its own rotor
// only, until the other flank is touched. What the motor moves against the coasting link is the play. About
// each such turn the links are moved by the recorded motors, and the torque that this needs is fitted to the
// recorded one (of one joint with a free load: diagnosis/gap_traverse.h):
//
//   J_j a_M = tau_j - friction_j(v_M) - T_j,   T_j = s F(|phi| - b_j / 2, s phi')
//   phi = q_M - q_j,   s = sign(phi),   F = T_u (k d / T_u)^p + c d' > 0
//   M(q_M) a + c(q_M, v_M) + g(q_M) = T - friction of the links - beta
//
// q_M: of the record. Links, drives and friction are those of the rig file after a fit to the whole record
// (arm/fit.h), so that friction and payload may be wrong in the file. Free within what is known: b, k, c, p,
// the rotor's share of what the motor moves, friction behind the gap, the time at which a torque was
// recorded; and of each turn alone beta, an unknown torque [N m] on each link, how the link swings
// on its teeth as the turn begins, and how much wider the gap seems there (10 % of it and 3 % of the
// deflection of the teeth): these equations are not exact, so that each turn says another gap, and without
// this freedom the turn with the hardest touch alone would decide. All joints and all turns are fitted
// together: what the play of one joint throws on the teeth of another is in M.
//
// The residual [N m], averaged over some samples, is weighted by its covariance: noise of the torque and of
// the position, an unknown slow torque (as large as the fit to the whole record leaves), and
// friction about a standstill. A turn of which much more is left at a joint loses weight there
// (fit/windowed_fit.h). Plays are tried 2 % apart before the fit, and once more with the teeth that it has
// found: a touch that comes a cycle of the teeth earlier or later explains a turn nearly as well.
//
// A joint whose link is too light for the sampling interval (fewer than eight samples in a cycle of its
// teeth) gets no answer; it is fitted as all others for what it throws on their teeth, and below four samples
// turns with its motor.
//
// Interval, 95 %: Student's t with the larger of two standard errors (turns as clusters; the fit's own), and
// `model` of the play and `law` of the deflection of the teeth for teeth that yield by no power: a soft start
// of the teeth and a small play move the motor alike. Of a joint without a play that is larger than its
// interval: at most the gap with which the record, all else fitted again, is explained worse by `rival`.
// No joint gets an answer while another one of those fitted with it is not explained.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/arm/motion.h"
#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/geared_arm/geared_arm.h"

namespace backlash::geared_arm {

struct TraverseSettings {
  double least_load = 0.1;    // of the largest |T|, beyond friction: below it the flank is not certain; as
                              // geared_arm/play.h
  double model = 0.05;        // of the play; choice, see the study in doc/evidence/arm.md
  double law = 0.13;          // of the deflection under the usual load; choice: teeth by no power
  double disagreement = 0.1;  // of the torque of the joint (rms) that the fitted chain may leave; choice
  double friction = 2;   // Coulomb's of the motor, that the load must reach on both flanks: what a bristle
                         // does about a standstill looks like a gap; choice, tried on other simulators
  double misfit = 1.5;   // noises that seven in ten turns may leave; choice
  double evidence = 30;  // by how much less a sound joint explains the record (minus twice the logarithm of
                         // the likelihood); choice: five standard errors and a half
  double far = 3.5;      // times stiffer or softer than declared: other teeth; choice: 2.5 spreads of the fit
  double flattest = 0.82, steepest = 1.58;  // powers at the ends of what the fit looks at; choice: such
                                            // teeth, a soft start for instance, yield by no power
  double rival = 9;                         // theory: three standard errors
  double vague = 0.2;  // half width of the interval, of the play, beyond which no play is reported; choice
  std::size_t least_turns = 4;  // that determine the play; choice, for a standard error that means something
};

/// A turn of the load in which the teeth crossed the gap.
struct Crossing {
  double time = 0;           // s, of the record: the teeth leave their flank
  double duration = 0;       // s, until they touch the other one
  int flank = 0;             // that is touched: 1 or -1, as the load
  double speed = 0;          // rad/s, of the motor
  std::vector<double> pose;  // rad, of all joints
};

struct JointTraverse {
  diagnosis::Estimate estimate;     // gap_traverse
  bool turns = false;               // the load is certain on either flank somewhere
  double misfit = 0;                // noises that are left in seven of ten turns at most
  std::vector<Crossing> crossings;  // where the play is reported
};

/// One per joint of the rig. `warnings` as arm::motions_of(). Throws BadData as that.
std::vector<JointTraverse> traverses_of(const GearedArm& arm, const arm::ArmRecord& record,
                                        std::vector<std::string>& warnings,
                                        const TraverseSettings& settings = {});

}  // namespace backlash::geared_arm
