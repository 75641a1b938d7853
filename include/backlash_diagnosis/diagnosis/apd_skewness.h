// SPDX-License-Identifier: BSD-3-Clause
// Backlash from the skewness of the APD, period by period, through a monitoring curve.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/family_match.h"
#include "backlash_diagnosis/diagnosis/monitoring_curve.h"
#include "backlash_diagnosis/diagnosis/period_analyser.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::diagnosis {

struct ApdSettings {
  record::Channel signal = record::Channel::sensor_torque;
  double period = 0;         // s; 0: found from the signal
  int settling_periods = 0;  // windows discarded at the start of a record
  ApdLayout layout;
};

/// Whole excitation periods as a SampleStream cuts them: their samples, and the APD of each.
struct PeriodWindow {
  record::Record record;
  double period = 0;                  // s; 0 where none was found: `record` is all that there is
  long count = 0;                     // whole periods in `record`
  std::vector<PeriodResult> periods;  // in order, also those with gaps; none where `record` lacks the signal
};

/// The APDs of a window.
struct ApdResult {
  double period = 0;                  // s; 0 where none was found
  std::vector<PeriodResult> periods;  // complete ones
  int incomplete = 0;              // windows left out because of gaps, or with no sample inside the classes
  double skewness = kNaN;          // mean over the periods
  signal::NoiseRange noise_range;  // of the signal
  double noise = kNaN;             // its upper end; NaN with fewer than two periods
  AmplitudeDistribution total{ApdLayout{2, 0, 1}};  // all periods together
};

/// Travel from wall to wall [unit of the position]: distance between its 5 % and 95 % quantiles, so that
/// ringing at the walls counts little. NaN for an empty list.
double travel_of(const std::vector<double>& position);

/// Excitation period of a record [s]: of motor_torque where recorded, else of `signal`. 0 where there is
/// none.
double excitation_period(const record::Record& record, record::Channel signal);

/// Length of a run after which its period is searched [s]; after that twice as long each time.
constexpr double kFirstPeriodSearch = 0.25;

/// Sums up the APDs of the periods of a window and estimates the noise of the signal. Throws InvalidParameter
/// for a layout outside its range.
ApdResult analyse_apd(const PeriodWindow& window, const ApdSettings& settings);

/// A condition of a curve that a record does not meet: what it is about, for an operator who wants to know
/// where to look, and the reason in words.
struct Mismatch {
  enum class Concern { curve, excitation, signal };
  Concern concern = Concern::curve;
  std::string reason;
};

/// Why a record was not taken under the conditions of a curve; nothing where it was. Compares sampling rate
/// (2 %), excitation amplitude and shape (5 %, from motor_torque where recorded), the signal's own level
/// (12 % beyond those on the curve), frequency (2 %, with two periods or more), noise, saturation, and
/// whether the output moves although it should be locked. What cannot be checked: without motor_torque, other
/// amplitudes within about 12 % and another shape with the same median magnitude; without motor_position,
/// backlash beyond the end of the curve; without it and load_position, an output that moves but leaves the
/// signal's level alone.
std::optional<Mismatch> out_of_domain(const record::Record& record, const ApdResult& apd,
                                      const ApdSettings& settings, const MonitoringCurve& curve);

/// What a curve says about a record before an estimator inverts it.
struct CurveMatch {
  signal::NoiseRange noise;           // of the record, with the error of its estimate
  std::optional<Estimate> refused;    // why no estimate can be made: status and reason
  std::optional<Mismatch> mismatch;   // where that is a condition of the curve
  std::optional<FamilyMatch> family;  // where none was refused and the curve has a family
};

/// Checks a record against the conditions of a curve (null: none is there), and its distribution against the
/// curve's family: one that resembles no member is out_of_domain.
CurveMatch match_curve(const record::Record& record, const ApdResult& apd, const ApdSettings& settings,
                       const MonitoringCurve* curve);

/// The estimate, or a status with its reason. `match` is that of the same record and curve.
Estimate estimate_apd_skewness(const ApdResult& apd, const CurveMatch& match, const MonitoringCurve* curve);

}  // namespace backlash::diagnosis
