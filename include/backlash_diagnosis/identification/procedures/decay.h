// SPDX-License-Identifier: BSD-3-Clause
// Mesh damping from the ringing that follows an engagement: how fast it dies (Yumrukcal 2013, Section 5.3.3).
//
// While the teeth stay in contact and friction keeps its sign, the difference between motor and load
// (position or speed) obeys Jp y'' + c y' + k y = constant, Jp = J1 J2 / (J1 + J2):
//   y(t) = c0 + c1 t + exp(-a t) (p cos(wd t) + q sin(wd t)),  a = z w0,  wd = w0 sqrt(1 - z^2),
//   c = 2 z sqrt(k Jp)  (5.10)  and also  c = 2 a Jp,
// equal where k and Jp agree with the ringing. Fitted to the raw samples of every engagement, with the
// thesis' method of peaks as a cross-check. The viscous
// friction of both bearings rings along and adds Jp^2 (c1/J1^2 + c2/J2^2) to c, 2 % on the rig of the thesis.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/procedures/ringing.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

enum class RingingSignal { speed_difference, position_difference };  // motor minus load

struct DecaySettings {
  signal::Measured stiffness;           // N m/rad, > 0; standard error may be NaN: taken as exact
  signal::Measured reduced_inertia;     // kg m^2, > 0
  double bearing_damping = 0;           // N m s/rad, >= 0: Jp^2 (c1/J1^2 + c2/J2^2), taken off the damping
  std::optional<RingingSignal> signal;  // absent: the speeds where both are recorded
  double longest = 5, shortest = 1.5;   // periods of sqrt(k / Jp), of the stretch that is fitted
  int least_engagements = 3;
};

struct DecayIdentification {
  RingingSignal signal = RingingSignal::speed_difference;
  signal::Measured damping_ratio, natural_frequency;  // -, rad/s, over the engagements
  signal::Measured damping;                           // N m s/rad, by 5.10, of the mesh
  signal::Measured damping_by_rate;                   // N m s/rad, 2 z w0 Jp, needs no stiffness
  signal::Measured peak_damping_ratio;                // cross-check; NaN with less than two engagements
  std::vector<Ringing> ringings;
  int steps = 0;  // torque steps, or passages of the gap, of which `ringings` could be used
  std::vector<std::string> warnings;
};

/// From a record of a square wave of torque. A stretch begins where the damped sine holds to the noise (and 1
/// % of its amplitude): not before the last loss of contact; it ends at the next step or where motor or load
/// turn back. Throws CannotIdentify without the channels, with fewer than `least_engagements` stretches, each
/// with an amplitude of five deviations of the residuals, InvalidParameter for settings.
DecayIdentification identify_decay(const record::Record& record, const DecaySettings& settings);

}  // namespace backlash::identification
