// SPDX-License-Identifier: BSD-3-Clause
// One answer from several estimates: those that agree combined, those that do not named, and what to do.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/baseline.h"
#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/diagnosis/limits.h"

namespace backlash::diagnosis {

enum class Grade { good, watch, service, stop, ungraded, cannot_tell };  // ungraded: a value, but no limits
const char* to_string(Grade grade);

struct Verdict {
  Grade grade = Grade::cannot_tell;
  int estimate = -1;            // index of the member with the narrowest interval; -1: none
  std::string agreement;        // "none", "single", "agree", or "disagree: ..." with the names
  std::vector<int> members;     // indices of the estimates that the verdict stands on
  std::vector<int> dissenters;  // of the sound ones that contradict them
  double backlash = kNaN, lower = kNaN, upper = kNaN;                    // m, 95 % interval; NaN end: open
  double backlash_angle = kNaN, angle_lower = kNaN, angle_upper = kNaN;  // rad, axis of motor_position
  double growth = kNaN, growth_lower = kNaN, growth_upper = kNaN;  // since the baseline, unit of the limits
  std::vector<ContradictedValue> declared_wrong;  // by sound estimates and those without play, not dissenters
  std::string message;
};

/// Sound are estimates with status ok, and with above_range where they give a lower bound. They agree where
/// their intervals, twice as wide (four standard deviations), have a point in common; where they have none as
/// they are the answer's interval holds all of them. Where one saw what others do not look for
/// (Estimate::must_hold) it holds all of that interval as well. The verdict stands on all sound estimates if
/// they agree.
///
/// Combination: the weighted mean of the members' values, of their lower and of their upper ends, weight
/// 1 / width^2 (inverse variance; lower bounds and estimates without interval have weight 0), the width being
/// without Estimate::declared: all methods rest on declared values, and few include that in the interval. The
/// members come from one record and share its noise, sampling and model, so their errors are correlated by an
/// unknown amount. The standard deviation of a weighted mean is at most the weighted mean of the standard
/// deviations, with equality for full correlation: the interval promises its 95 % whatever the correlation
/// is, and is never narrower than the best member's. (Covariance intersection of scalars, after Julier and
/// Uhlmann 1997, is the best member alone; it is as honest but takes nothing from the others.)
///
/// Where one of the members has fitted the machine's values to the record (Estimate::fits_machine), the
/// verdict is its answer alone: the others agree, but rest on values that may be wrong.
///
/// Where one gives the play from wall to wall under torque (Estimate::deflection) that is the quantity
/// of the verdict, and free play that fits into it is reported as a part of it.
///
/// Contradiction: never settled by the number of methods, as those that share signal, curve or declared
/// values err together. Estimates of one Estimate::witness that contradict each other are left out where
/// there is another witness. Then what was measured on the record (Estimate::from_record) stands against
/// what takes the machine from the rig file: the contradiction shows that the file may be wrong. Where that
/// does not settle it the verdict is cannot_tell, without a value.
///
/// Grade: by the limits, of the combined value or with a baseline of its growth since then. `good` only where
/// the whole interval is below `watch`; a value below it with an interval that is not is `watch`. The message
/// names the other grades that the interval reaches into. Without limits a value is `ungraded`. Lower bounds
/// alone are graded by the highest of them, or cannot_tell below `watch` and without limits. The interval of
/// the growth adds the uncertainties of now and then as independent ones: different records; what they share
/// cancels. A baseline without interval is taken as exact.
Verdict combine(const std::vector<Estimate>& estimates, const std::optional<Limits>& limits,
                const std::optional<Baseline>& baseline);

}  // namespace backlash::diagnosis
