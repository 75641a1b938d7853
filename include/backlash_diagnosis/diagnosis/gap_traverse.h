// SPDX-License-Identifier: BSD-3-Clause
// Play from the motor's side alone, on a joint whose load is free, in ordinary motion: while the gap is
// crossed the motor carries its own inertia only, so what it moves against the coasting load, from break-away
// to touch, is the play (Nordin and Gutman 2002; Villwock and Pacas 2009). About each crossing the load is
// moved by the recorded motor, and the torque that this needs is fitted to the recorded one:
//
//   Jm qm'' = tau - bm qm' - cm sign(qm') - F       F = T (k d / T)^p + c d' > 0, d = |qm - ql| - gap / 2
//   Jl ql'' = F - cl sign(ql')                      F has the sign of qm - ql
//
// with gap, k, p, c, Jl, Jm, bm, cm and cl of all crossings together, free within what is known of them, and
// of each two start values and a torque on motor and load. All at the motor_position axis. The teeth are a
// spring at the usual torque T, and may yield by a power p of the deflection, 1 within a factor of 1.5 (1.5:
// Hertz), as far as the record tells. Beyond 1.55 nothing is told: no contact is so steep, and teeth that are
// softer at first than a power, or two gaps in a row, look like that and like another play.
//
// The stretch about a crossing is as long as four of five crossings take, from a sure press on their flank to
// the first touches, so that a play many times the declared one fits in, and more than half of the crossings
// must lie in such a stretch: the quick ones alone tell a smaller play, with nothing but noise left. Fits
// begin with five gaps, and with others about the cheapest one's until none is cheaper.
//
// A stretch begins while the motor moves and the teeth press one flank for sure: by more than noise and half
// of the declared dry friction of the motor, for as long as the torque is averaged. The motor that such
// crossings tell finds more of them.
//
// Teeth touch and leave within a step of the integration, at the moment that it finds: damped teeth push at
// once, and steps across that make a cost with as many minima as there are touches.
//
// What is left is weighted by its covariance: noise of the torque, a slow torque that nothing tells (5 % of
// T), and noise of the position, which second differences make large and fast. The inertia of the motor
// multiplies that noise, and a fit that counted it as it is would take a smaller inertia for a better one
// (attenuation); its fast part is all but left out.
//
// Needs motor_torque and motor_position, evenly sampled, at least eight samples in a cycle of the motor
// against the load, and 20 crossings that begin in contact. No period.
//
// Interval, 95 %: Student's t with the larger of two standard errors of the logarithm (crossings as clusters;
// the fit's own), 20 % for what these equations do not hold, and 10 % of the deflection of the teeth under T:
// checked on simulated machines with cogging, gravity, Stribeck friction, varying play, transmission errors
// and teeth after Hertz that are not told to the fit, and on such whose play is a thirtieth of the
// deflection.
#pragma once

#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::diagnosis {

/// The declared machine, at the motor_position axis.
struct GapTraverseSettings {
  double motor_inertia = kNaN, load_inertia = kNaN;  ///< kg m^2, > 0
  double motor_damping = 0;                          ///< N m s/rad, >= 0
  double motor_friction = 0, load_friction = 0;      ///< N m, >= 0, dry
  double stiffness = kNaN, damping = kNaN;           ///< N m/rad, N m s/rad, > 0, of the flanks
  double gap = 0;                                    ///< rad, >= 0: where the fit begins, with any error
  double base_radius = kNaN;                         ///< m, > 0; NaN: Estimate::backlash is NaN
};

/// Throws InvalidParameter for settings outside the ranges above. Answers by status:
///   insufficient_data  a channel is missing; too few crossings, and which motion would give them; the
///                      crossings do not tell the play
///   out_of_domain      uneven or too coarse samples; the equations do not fit the record, or only with
///                      values far from the declared ones
///   ambiguous          two plays fit alike
///   below_range        the play is less than the noise of the torque hides, or a fifth of the deflection
Estimate estimate_gap_traverse(const record::Record& record, const GapTraverseSettings& settings);

}  // namespace backlash::diagnosis
