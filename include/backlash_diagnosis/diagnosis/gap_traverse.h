// SPDX-License-Identifier: BSD-3-Clause
// Play of a joint whose load is free, in ordinary motion, by a machine fitted to the record
// (fit/windowed_fit.h). In windows of the record the load is moved by the recorded motor through teeth with
// play (Nordin and Gutman 2002):
//
//   Jl ql'' = T - bl ql' - cl sign(ql') - f tau_l(ql) - own        T has the sign of qm - ql, and is 0 within
//   the gap |T| = K d x^(p - 1) (1 + h x^2) / (1 + h) + c x^r d' > 0       d = |qm - ql| - gap / 2,  x = K d
//   / T0
//
// all at the motor_position axis. T0 is the usual torque, tau_l what declared terms take of the load, `own` a
// torque of the window that nothing explains. The law of the teeth is free between lines and points that
// touch (p = 1 to 1.5), with hardening h and a damping that may follow the deflection (r = 0: damper; 1.5:
// Hunt and Crossley 1975); K and c are those at T0.
//
// With load_position, what is left of that channel counts: its encoder shows ql later by a skew, from any
// zero, with an eccentric disk, and some error of the window. The torque is not asked for. Windows lie side
// by side over all of the record; in those where both flanks are seen lies what is known of the gap.
//
// Without it, what is left of the motor's torque counts (Villwock and Pacas 2009): while the gap is crossed
// the motor carries its own inertia only,
//
//   Jm qm'' = tau(t - late) - bm qm' - cm sign(qm') - waves(qm) - T - own
//
// with waves of two orders over the motor's turn (cogging, a first stage that runs out), as far as the record
// shows them. Windows begin in contact, about a crossing: the motor moves and the teeth press one flank for
// sure, by more than noise and half of the declared dry friction of the motor. The motor that such crossings
// give finds more of them. What is left is weighted by its covariance: noise of the torque, a slow torque
// that nothing explains (5 % of T0), and noise of the position, which second differences make large and fast;
// its fast part is all but left out, as the inertia of the motor multiplies it (attenuation).
//
// Teeth touch and leave within a step of the integration, at the moment that it finds: damped teeth push at
// once, and steps across that make a cost with as many minima as there are touches. Fits begin with several
// gaps, of loads that bounce and that do not, of declared torques on the load as large as known and larger
// (which keep one flank pressed), and with other gaps about the cheapest one's.
//
// An answer passes five gates: both flanks are pressed, whatever the declared torque of the load is within
// two standard errors; the motor alone: more than a third of all crossings lie in windows, since the
// quick ones alone show a smaller play; stiffness and inertias are within four spreads of the declared ones;
// a third of the channel at most is left beyond noise; the interval is narrower than a factor of four.
//
// Interval, 95 %, of all plays that fit alike, and of either half of the record where that is sure of
// another: Student's t with the larger of two standard errors of the logarithm (the fit's own; windows as
// clusters), 4 % of the play for what the machine does not hold (15 % by the motor alone) and the share of
// the channel that is left beyond noise, and a fifth of the deflection of a flank under T0 for laws of teeth
// that are none of these, and five times what the joint moves while the times of the samples are not known
// (record/even_grid.h). Of a commissioned machine (GapTraverseSettings::unexplained) the law of the teeth was
// tried. In place of the fifth stands 9.2 times the rms of what the commissioning left beyond noise where
// that is less; as much less p, r and h may differ from those of the declared law. Counted on joints of
// test/campaigns/robot_joints that were drawn afterwards (doc/evidence/gap_traverse.md).
//
// Needs motor_position, and load_position or motor_torque. Samples are put on an even grid
// (record/even_grid.h), of at least two samples in a cycle of the motor against the load, four by the motor
// alone. No period. Refused where the joint moves by more than a twentieth of the range of motor minus load
// position while the time of a sample is not known; by the motor alone where that makes its inertia take more
// than T0.
#pragma once

#include <cmath>
#include <functional>

#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::diagnosis {

/// The declared machine, at the motor_position axis.
struct GapTraverseSettings {
  double motor_inertia = kNaN, load_inertia = kNaN;  ///< kg m^2, > 0
  double motor_damping = 0;                          ///< N m s/rad, >= 0
  double load_damping = 0;                           ///< N m s/rad, >= 0
  double motor_friction = 0, load_friction = 0;      ///< N m, >= 0, dry
  /// A flank under a torque: torque and damping follow these powers of the deflection nearby.
  struct Flank {
    double stiffness = kNaN, damping = kNaN;  ///< N m/rad, N m s/rad, > 0
    double power = 1, damping_power = 0;      ///< p > 0, r: a spring and a damper
  } flank;
  /// Of teeth that are no spring: `flank` for T0 [N m], > 0, of the record; empty: as it is.
  std::function<Flank(double torque)> flank_under;
  double gap = 0;                ///< rad, >= 0: where the fit begins, with any error
  double motor_turn = 2 * M_PI;  ///< rad of motor_position in a turn of the motor, > 0
  double base_radius = kNaN;     ///< m, > 0; NaN: Estimate::backlash is NaN
  /// rad, >= 0, rms of what the commissioned machine left of motor minus load position beyond noise; NaN: the
  /// machine was not commissioned with both encoders.
  double unexplained = kNaN;
  /// N m that declared terms (gravity, cogging) take of load and motor at rest at this position [rad]; empty:
  /// none.
  std::function<double(double)> load_torque, motor_torque;
};

/// Throws InvalidParameter for settings outside the ranges above. Answers by status:
///   insufficient_data  a channel is missing; a flank is not pressed; too few crossings; the interval is too
///   wide out_of_domain      too coarse samples; no machine like the declared one explains the record
Estimate estimate_gap_traverse(const record::Record& record, const GapTraverseSettings& settings);

}  // namespace backlash::diagnosis
