// SPDX-License-Identifier: BSD-3-Clause
// Inertia from sine runs: torque over speed at the line of the excitation. Yumrukcal (2013), Sections 5.1.2
// and 5.2.2.
//
//   T(w) = (i w I + c) V(w)   ->   I = Im(T / V) / w,  c = Re(T / V)
//
// T, V complex amplitudes, I [kg m^2] all that turns (below the resonance), c [N m s/rad]. Holds where the
// speed never reverses: Coulomb friction is then a constant and has no line. In magnitudes
// I = sqrt(|T|^2 - (c |V|)^2) / (w |V|); (5.4) prints a minus in front of it.
//
// Of a whole drive T = (i w I1 + c1) V1 + (i w I2 + c2) V2 whatever happens between the teeth: their torque
// acts on both and cancels. V is then the mean of both speeds weighted with the inertias. The motor's speed
// alone reads (f / F_AR)^2 too much, 0.9 % at 1 Hz with F_AR = 10.4 Hz, and more where the teeth change
// flanks, which they do unless the load's friction exceeds its I2 w |V|.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

struct LineInertiaOptions {
  double frequency = 0;     // Hz; 0: the largest line of the speed
  double skip = 1;          // cycles left out at the start (transient)
  double torque_delay = 0;  // s: how much later than its stamp the torque acts; half an interval where a
                            // recorded command is held. Untreated it takes w^2 I delay off c.
  double motor_share = 1;   // of the motor in the inertia, 0 to 1. Below 1 the speed is the mean of motor and
                            // load with this weight, where both are recorded.
};

/// What one run gives.
struct LineInertia {
  signal::Measured inertia, viscous;  // kg m^2, N m s/rad
  double frequency = 0;               // Hz
  double torque = 0, speed = 0;       // amplitudes, N m, rad/s
  double mean_speed = 0;              // rad/s
  std::size_t cycles = 0;             // used
};

/// One run: least squares of mean, slope and sine over whole cycles (from the position, where recorded, mean,
/// slope, curvature and sine, times i w), from the first cycle on whose sine is that of the later ones.
/// Standard errors by leaving out one cycle after the other. Throws
/// CannotIdentify with fewer than four cycles after the skipped ones, where the speed reverses or stops, no
/// line stands out (the sine explains less than half of the speed about its mean), or a channel is missing;
/// InvalidParameter for options < 0.
LineInertia line_inertia(const record::Record& record, const LineInertiaOptions& options = {});

/// The magnitude form. Throws InvalidParameter where an argument is not > 0 (viscous: >= 0) or the viscous
/// part exceeds the torque. [N m, rad/s, Hz, N m s/rad]
double inertia_from_amplitudes(double torque, double speed, double frequency, double viscous = 0);

}  // namespace backlash::identification
