// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/declared_spread.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/diagnosis/monitoring_curve.h"

namespace backlash::diagnosis {
namespace {

constexpr double kMuchWider = 2;  // choice: times the interval without what the file leaves open

/// Interpolates linearly between the points of the curve.
double at(const MonitoringCurve& curve, const std::vector<double>& values, double backlash) {
  std::size_t i = 0;
  while (i + 2 < curve.points.size() && curve.points[i + 1].backlash < backlash) ++i;
  const double from = curve.points[i].backlash, to = curve.points[i + 1].backlash;
  const double share = std::clamp((backlash - from) / (to - from), 0.0, 1.0);
  return values[i] + share * (values[i + 1] - values[i]);
}

void refuse(Status status, const std::string& why, const DeclaredSpread& spread, Estimate& e) {
  e.status = status;
  e.backlash = e.backlash_angle = kNaN;
  e.message += fmt::format("; {}: limited by the declared {}", why, spread.limit);
}

void widen_answer(const MonitoringCurve& curve, const DeclaredSpread::Widening& by, Estimate& e) {
  const double below = at(curve, by.below, e.backlash), above = at(curve, by.above, e.backlash);
  const double width = e.upper - e.lower;
  e.lower = std::max(0.0, e.lower - below);
  e.upper += above;
  if (e.upper - e.lower > kMuchWider * width)
    e.message += "; interval limited by the declared " + curve.spread->limit;
}

void widen_bound(const MonitoringCurve& curve, const DeclaredSpread::Widening& by, Estimate& e) {
  if (e.lower > by.bound) {
    e.lower -= by.bound;
    return;
  }
  e.lower = kNaN;
  refuse(Status::ambiguous, "with what the rig file leaves open any backlash fits", *curve.spread, e);
}

}  // namespace

void widen(const MonitoringCurve& curve, DeclaredSpread::Widening DeclaredSpread::*method, Estimate& e) {
  if (!curve.spread || (e.status != Status::ok && e.status != Status::above_range)) return;
  const DeclaredSpread& spread = *curve.spread;
  if (e.status == Status::ok) {
    widen_answer(curve, spread.*method, e);
  } else {
    widen_bound(curve, spread.*method, e);
  }
  e.backlash_angle = e.backlash * curve.backlash_to_angle;
  e.angle_lower = e.lower * curve.backlash_to_angle;
  e.angle_upper = e.upper * curve.backlash_to_angle;
}

}  // namespace backlash::diagnosis
