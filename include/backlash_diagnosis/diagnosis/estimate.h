// SPDX-License-Identifier: BSD-3-Clause
// What an estimator answers. "Cannot tell" is an answer: a status other than ok, with its reason in plain
// words.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/not_a_number.h"

namespace backlash::diagnosis {

enum class Status {
  ok,
  below_range,        ///< the signal says less backlash than the method can resolve or the curve covers
  above_range,        ///< more backlash than the curve covers
  out_of_domain,      ///< the record was not taken under the conditions that the method or curve needs
  insufficient_data,  ///< a channel, a curve or enough samples are missing
  ambiguous,          ///< several backlash values explain the signal equally well
};
const char* to_string(Status status);

/// Parts of the play between the two flanks, by estimators that can separate them. Angles at the
/// motor_position axis.
struct PlayComponents {
  double gap = kNaN;         ///< rad, free play without elastic deflection
  double compliance = kNaN;  ///< rad/(N m), elastic deflection per torque on one flank
  double coulomb = kNaN;     ///< N m, half the width of the friction hysteresis
  double at_torque = kNaN;   ///< N m, torque at which backlash_angle holds
};

/// A value of the rig file that the record contradicts.
struct ContradictedValue {
  std::string name, unit;
  double declared = kNaN, found = kNaN;  ///< in the unit
  double standard_error = kNaN;          ///< of what was found
};
/// "declared motor damping 0.0048 N m s/rad, this record says 0.0029 +- 2e-05: run identify"; empty for none.
std::string contradiction_text(const std::vector<ContradictedValue>& contradicted);

struct WaveformEvidence;  // diagnosis/waveform.h

/// An estimate of backlash. NaN where not known: `backlash` for a rig without base radius, all where status
/// says so.
struct Estimate {
  std::string method;
  Status status = Status::insufficient_data;
  double backlash = kNaN;                         ///< m, total free play along the line of action
  double lower = kNaN, upper = kNaN;              ///< m, 95 % interval of backlash
  double backlash_angle = kNaN;                   ///< rad, the same as an angle on the axis of motor_position
  double angle_lower = kNaN, angle_upper = kNaN;  ///< rad, 95 % interval of backlash_angle
  double skewness = kNaN;  ///< of the class values of the APD, where the method uses it
  std::optional<PlayComponents> components;
  double declared = 0;  ///< rad, >= 0, half width of the 95 % interval by declared values alone, where known
  std::string witness;  ///< equal for methods that share signal, curve and declared values; empty: its own
  /// The interval holds what others do not see: a play that depends on the position, teeth that yield by
  /// another law than the declared one. The verdict's holds it too.
  bool must_hold = false;
  /// rad, > 0: from wall to wall under torque, of which at most this is deflection, the rest free play; 0:
  /// free play, or the deflection is not known.
  double deflection = 0;
  bool from_record = false;   ///< what the value depends on was measured on the record, not declared
  bool fits_machine = false;  // of from_record: the values of the machine that other methods take from the
                              // rig file were fitted with it, so that they add nothing
  double age = 0;  ///< s, >= 0, by which the samples that it rests on ended before those of the diagnosis
  std::vector<ContradictedValue> declared_wrong;
  std::shared_ptr<const WaveformEvidence> waveform;  ///< null but of `waveform`
  std::string message;  ///< the reason of the status, or how the value came about
};

}  // namespace backlash::diagnosis
