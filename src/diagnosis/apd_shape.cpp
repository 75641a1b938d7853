// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/apd_shape.h"

#include <sstream>

namespace backlash {
namespace {

Estimate answer(const FamilyMatch& match, const MonitoringCurve& curve, std::size_t periods) {
  Estimate estimate;
  std::ostringstream text;
  text.precision(3);
  text << "rms distance " << match.misfit << " from the nearest distribution of " << curve.conditions.rig
       << " over " << periods << " period(s)";
  const double span = curve.points.back().backlash - curve.points.front().backlash;
  estimate.lower = match.lower;
  if (!match.touches_end) estimate.upper = match.upper;
  if (match.upper - match.lower > 0.5 * span) {
    estimate.status = Status::ambiguous;
    text << "; more than half of the curve fits";
  } else if (match.touches_end) {
    estimate.status = Status::above_range;
    text << "; the end of the curve fits, backlash may be larger than it covers";
  } else {
    estimate.status = Status::ok;
    estimate.backlash = match.backlash;
  }
  estimate.message = text.str();
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
  estimate.method = "apd_shape";
  estimate.skewness = apd.skewness;
  return estimate;
}

}  // namespace backlash
