// Inertia from sine runs: torque over speed at the line of the excitation. Yumrukcal (2013), Sections 5.1.2
// and 5.2.2.
//
//   T(w) = (i w I + c) V(w)   ->   I = Im(T / V) / w,  c = Re(T / V)
//
// T, V complex amplitudes, I [kg m^2] all that turns (below the resonance), c [N m s/rad]. Holds where the
// speed never reverses: Coulomb friction is then a constant and has no line. In magnitudes
// I = sqrt(|T|^2 - (c |V|)^2) / (w |V|); (5.4) prints a plus.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/identification/measured.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash {

struct LineInertiaOptions {
  double frequency = 0;     // Hz; 0: the largest line of the speed
  double skip = 1;          // cycles left out at the start (transient)
  double torque_delay = 0;  // s: how much later than its stamp the torque acts; half an interval where a
                            // recorded command is held. Untreated it takes w^2 I delay off c.
};

/// What one run gives.
struct LineInertia {
  Measured inertia, viscous;     // kg m^2, N m s/rad
  double frequency = 0;          // Hz
  double torque = 0, speed = 0;  // amplitudes, N m, rad/s
  double mean_speed = 0;         // rad/s
  std::size_t cycles = 0;        // used
};

/// One run: least squares of mean, slope and sine over whole cycles (from the position, where recorded, mean,
/// slope, curvature and sine, times i w). Standard errors by leaving out one cycle after the other. Throws
/// CannotIdentify with fewer than four cycles after the skipped ones, where the speed reverses or stops, no
/// line stands out (the sine explains less than half of the speed about its mean), or a channel is missing;
/// InvalidParameter for options < 0.
LineInertia line_inertia(const Record& record, const LineInertiaOptions& options = {});

/// The magnitude form. Throws InvalidParameter where an argument is not > 0 (viscous: >= 0) or the viscous
/// part exceeds the torque. [N m, rad/s, Hz, N m s/rad]
double inertia_from_amplitudes(double torque, double speed, double frequency, double viscous = 0);

/// One inertia from several runs, outliers weighted down (Huber); the standard error is the runs' own
/// scatter.
struct CombinedInertia {
  Measured inertia;
  std::vector<std::size_t> outliers;  // rows beyond three standard deviations
};
/// Throws CannotIdentify without values; a single one is returned as it is.
CombinedInertia combined_inertia(const std::vector<Measured>& runs);

}  // namespace backlash
