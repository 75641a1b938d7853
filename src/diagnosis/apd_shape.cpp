// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/apd_shape.h"

#include <fmt/core.h>

namespace backlash::diagnosis {
namespace {

Estimate answer(const FamilyMatch& match, const MonitoringCurve& curve, std::size_t periods) {
  Estimate estimate;
  estimate.message = fmt::format(
      "rms distance {:.3g} from the nearest distribution of {} over {} period(s), simulated records were "
      "within "
      "{:.3g}",
      match.misfit, curve.conditions.rig, periods, match.usual_misfit);
  const double span = curve.points.back().backlash - curve.points.front().backlash;
  estimate.lower = match.lower;
  if (!match.touches_end) estimate.upper = match.upper;
  if (match.upper - match.lower > 0.5 * span) {
    estimate.status = Status::ambiguous;
    estimate.message += "; more than half of the curve fits";
  } else if (match.touches_end) {
    estimate.status = Status::above_range;
    estimate.message += "; the end of the curve fits, backlash may be larger than it covers";
  } else {
    estimate.status = Status::ok;
    estimate.backlash = match.backlash;
  }
  estimate.backlash_angle = estimate.backlash * curve.backlash_to_angle;
  estimate.angle_lower = estimate.lower * curve.backlash_to_angle;
  estimate.angle_upper = estimate.upper * curve.backlash_to_angle;
  return estimate;
}

}  // namespace

Estimate estimate_apd_shape(const ApdResult& apd, const CurveMatch& match, const MonitoringCurve* curve) {
  Estimate estimate;
  if (match.refused)
    estimate = *match.refused;
  else if (match.family)
    estimate = answer(*match.family, *curve, apd.periods.size());
  else
    estimate.message = "the curve has no family of distributions; build it anew";
  if (!match.refused) widen(*curve, &DeclaredSpread::shape, estimate);
  estimate.method = "apd_shape";
  estimate.skewness = apd.skewness;
  return estimate;
}

}  // namespace backlash::diagnosis
