// SPDX-License-Identifier: BSD-3-Clause
// An answer of a method that takes seconds (`waveform`, `gap_traverse`), beside a diagnosis of later samples
// of the same machine.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/diagnose.h"

namespace backlash::diagnosis {

/// The torque of the sensor over the phase of the excitation's period, in at most 200 bins; empty where there
/// is no period.
struct MeanPeriod {
  std::vector<double> mean, squares, count;  ///< N m; (N m)^2, sum about the mean; samples
  double swing = 0;                          ///< N m, half of the largest less the smallest
};
MeanPeriod mean_period(const PeriodWindow& window);

/// What a method found on samples that ended at `end`, and what the quick methods found on the same.
struct EarlierAnswer {
  std::string method;
  double end = 0;  ///< s, on the clock of the samples
  Estimate estimate;
  std::vector<Estimate> others;
  MeanPeriod period;
};

/// Both on the same samples. Throws as diagnose() does.
EarlierAnswer answer_of(const std::string& method, const PeriodWindow& window,
                        const DiagnosisSettings& settings, const MonitoringCurve* curve);

/// Puts the earlier answer into a diagnosis of a window that left its method out, and combines anew. Its age
/// is reported, in Estimate::age and in the messages. It is not used, and the reason is reported, where
///   - it is older than 300 s: a choice, as play grows by months;
///   - the machine has changed since: another method has moved by more than both its intervals (without what
///     they have of declared values, which is the same in both, and not below a fiftieth of the value), or
///     contradicts the answer now and did not then; or the mean period of the sensor's torque is another: by
///     more than two standard errors, as a mean over the period, of which a hundredth of the swing is no
///     change;
///   - the samples of now contradict the declared lock.
void recall(Diagnosis& diagnosis, const EarlierAnswer& earlier, const PeriodWindow& window,
            const std::optional<Limits>& limits, const std::optional<Baseline>& baseline);

}  // namespace backlash::diagnosis
