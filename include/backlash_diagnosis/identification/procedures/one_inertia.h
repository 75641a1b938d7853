// SPDX-License-Identifier: BSD-3-Clause
// A machine that is one inertia with friction, from any record of motion (inverse dynamics):
//
//   inertia a + viscous v + coulomb sign(v) + offset [+ s sin(q) + c cos(q)] = torque
//
// The last two where the rig declares gravity: amplitude sin(q + phase), amplitude = hypot(s, c), phase =
// atan2(c, s). a, v from motor_position by central differences. Torque and all four columns go through the
// same zero-phase low-pass, so that the filter takes nothing off the parameters (Gautier 1997; Janot,
// Gautier, Brunot 2019, whose EMPS axis has M 95.1 kg, Fv 203.5 N s/m, Fc 20.4 N, offset -3.2 N). SI units,
// rotary or force and length.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

struct OneInertiaOptions {
  double cutoff = 0;  // Hz; 0: the bandwidth of the motion (bandwidth.h), at least 100 periods in the record
  std::optional<double> delay;  // s, given; none: estimated within +-2 sampling intervals
  bool gravity = false;         // the machine has a weight off its axis
  std::vector<bool> lost = {};  // of each sample of an even record: it was not recorded; empty: all were
};

struct OneInertia {
  signal::Measured inertia, viscous, coulomb, offset;  // kg m^2, N m s/rad, N m, N m (kg, N s/m, N, N)
  bool gravity = false;
  signal::Measured gravity_sine, gravity_cosine;  // N m, s and c above; 0 without gravity
  signal::Measured delay;  // s: the torque acts that much later than its stamp says, seen from the position;
                           // a command that is held until the next sample has half an interval of it
  double cutoff = 0;       // Hz
  double smoothed = 0;  // Hz: all columns were low-passed here before what stands still was taken out; 0: not
  double relative_error = 0;                      // norm(residual) / norm(torque - its mean), both filtered
  double floor = 0;                               // of that, by the white noise of torque and position alone
  double used = 0;                                // share of the samples
  std::vector<double> time, measured, predicted;  // filtered torque of the samples that are used
  std::vector<std::string> warnings;
};

/// A machine is one inertia only in slow motion. If the lower half of the band gives another inertia, beyond
/// the errors of both, the upper half contains something else (an elastic gear, a drive that chatters); then
/// the lower half is used, down to `kFewestPeriods` of the cutoff in the record.
///
/// Left out: both ends (one period of the cutoff) and standstill, where friction takes any value between its
/// bounds: speed below four standard deviations of its noise for longer than a quarter of the filter's memory
/// 1 / (2 cutoff), widened by that memory. A reversal is kept: the direction is known (from the speed in
/// the widest band in which its noise is a thousandth of it, but at least four times the cutoff). The delay
/// is an unknown like the others; where it is vague (standard error beyond one interval, or at the edge of
/// the search, two intervals or a fifth of a period of the cutoff), it is taken as 0, its error is NaN and
/// a warning says so; standard errors by leaving out thirtieths of the record (jackknife). Where more is left
/// than 1.5 times what noise leaves, they also hold how far a likely effect that the equation lacks (drag,
/// friction that falls with speed or depends on direction, load, position or time, gravity) may have drawn
/// each parameter. Throws CannotIdentify where motor_torque or motor_position is missing, the record is
/// shorter than 64 samples or 40 periods of the cutoff, or one direction has less than 5 % of the samples;
/// InvalidParameter for a cutoff beyond 0.4 of the sampling rate or a delay beyond two intervals.
OneInertia identify_one_inertia(const record::Record& record, const OneInertiaOptions& options = {});

/// What a machine says of a record, by its own parameters, cutoff and delay: errors, and the samples that
/// identify_one_inertia would use. Throws as that, but needs no second direction.
OneInertia applied(const OneInertia& machine, const record::Record& record,
                   const std::vector<bool>& lost = {});

/// The machine of several records: of each parameter signal::weighted_mean(), with an error no smaller than
/// the smallest of them where an effect that the equation lacks may draw all alike (more than 1.5 times the
/// noise is left). Delay, cutoff and samples are those of the first.
OneInertia combined(const std::vector<OneInertia>& machines);

}  // namespace backlash::identification
