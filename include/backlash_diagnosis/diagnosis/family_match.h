// SPDX-License-Identifier: BSD-3-Clause
// Where in the family of distributions a record belongs.
#pragma once

#include "backlash_diagnosis/diagnosis/monitoring_curve.h"

namespace backlash::diagnosis {

struct FamilyMatch {
  double backlash = kNaN;             // m (angular mesh: rad), of the nearest distribution on the curve
  double lower = kNaN, upper = kNaN;  // 95 % interval, see apd_family.h; at most the end of the curve
  bool touches_end = false;           // the end of the curve or more lies in the interval
  double misfit = kNaN;               // rms distance from the nearest distribution, unit of the signal
  double usual_misfit = kNaN;         // the largest among the simulated records there

  /// Whether the record is farther from the whole family than chance explains: the machine does something
  /// that the rig does not contain, or has other values.
  bool fits_no_member() const { return misfit > kLargestMisfit * usual_misfit; }

  /// Choice, by simulation: of the largest misfit among the simulated records. See
  /// doc/reference/estimators.md.
  static constexpr double kLargestMisfit = 1.25;
};

/// Compares samples of whole periods with the curve's family (which must be there), at any noise of a range
/// (NaN: any that the curve covers).
FamilyMatch match_family(const MonitoringCurve& curve, std::vector<double> samples,
                         const signal::NoiseRange& noise);

}  // namespace backlash::diagnosis
