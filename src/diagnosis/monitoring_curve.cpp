// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/monitoring_curve.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/quadratic.h"

namespace backlash::diagnosis {
namespace {

constexpr double kFloor = 1e-6;  // smallest difference of skewness that may count as one
constexpr double kInfinity = std::numeric_limits<double>::infinity();

SkewnessCell mix(const SkewnessCell& a, const SkewnessCell& b, double share) {
  const auto line = [share](double x, double y) { return x + share * (y - x); };
  return {line(a.mean, b.mean), line(a.between, b.between), line(a.within, b.within)};
}

/// Index i and share s with values[i] (1 - s) + values[i + 1] s = x, clamped to the ends.
template <typename Get>
std::pair<std::size_t, double> locate(std::size_t count, Get value, double x) {
  if (count < 2 || x <= value(0)) return {0, 0};
  std::size_t i = 0;
  while (i + 2 < count && value(i + 1) < x) ++i;
  return {i, std::clamp((x - value(i)) / (value(i + 1) - value(i)), 0.0, 1.0)};
}

/// Structure finer than the grid about point i: rms distance of the runs in the middle of the segments around
/// it from the straight line. Divided by 1.5, the variance of a value minus the mean of two others of
/// variance 1.
double roughness(const std::vector<CurvePoint>& points, const std::vector<std::vector<SkewnessCell>>& middle,
                 std::size_t i, std::size_t level) {
  double sum = 0;
  int count = 0;
  for (std::size_t k = i < 2 ? 0 : i - 2; k < std::min(i + 2, middle.size()); ++k, ++count) {
    const double line = 0.5 * (points[k].cells[level].mean + points[k + 1].cells[level].mean);
    sum += std::pow(middle[k][level].mean - line, 2) / 1.5;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

/// Scatter at point i, together with its two neighbours in the middle of segments: eight runs at one backlash
/// say little.
SkewnessCell shared_scatter(const std::vector<CurvePoint>& points,
                            const std::vector<std::vector<SkewnessCell>>& middle, std::size_t i,
                            std::size_t level) {
  SkewnessCell cell = points[i].cells[level];
  double between = cell.between * cell.between, within = cell.within * cell.within;
  int count = 1;
  for (std::size_t k = i < 1 ? 0 : i - 1; k < std::min(i + 1, middle.size()); ++k, ++count) {
    between += std::pow(middle[k][level].between, 2);
    within += std::pow(middle[k][level].within, 2);
  }
  cell.between = std::sqrt(between / count);
  cell.within = std::sqrt(within / count);
  return cell;
}

/// Backlash values that agree with an observation.
struct Accepted {
  double best = kNaN, best_distance = kInfinity;
  double lower = kNaN, upper = kNaN;
  bool touches_end = false, in_flagged_stretch = false;
  int pieces = 0;
};

/// All backlash values whose model agrees with the observation within the 95 % limits (Neyman's
/// construction): (skewness - mean(b))^2 <= (coverage_factor sigma(b))^2, between two points a quadratic
/// inequality.
Accepted accept(const MonitoringCurve& curve, double skewness, int periods, double noise) {
  Accepted result;
  for (std::size_t i = 0; i + 1 < curve.points.size(); ++i) {
    const double from = curve.points[i].backlash, span = curve.points[i + 1].backlash - from;
    const SkewnessCell cell = curve.at(from, noise), next = curve.at(from + span, noise);
    const double offset = skewness - cell.mean, slope = next.mean - cell.mean;
    double a = slope * slope, b = -2 * offset * slope, c = offset * offset - kFloor * kFloor;
    const auto widen = [&](double at_start, double at_end, double divisor) {
      const double factor = curve.coverage_factor * curve.coverage_factor / divisor,
                   change = at_end - at_start;
      a -= factor * change * change;
      b -= factor * 2 * at_start * change;
      c -= factor * at_start * at_start;
    };
    widen(cell.between, next.between, 1);
    widen(cell.within, next.within, std::max(1, periods));
    for (const auto& [begin, end] : signal::quadratic_at_most_zero(a, b, c)) {
      if (result.pieces == 0) result.lower = from + begin * span;
      if (result.pieces == 0 || from + begin * span > result.upper) ++result.pieces;
      result.upper = from + end * span;
      result.touches_end = i + 2 == curve.points.size() && end == 1;
      if (!curve.points[i + 1].monotonic || !curve.points[i].monotonic) result.in_flagged_stretch = true;
    }
    const double crossing = std::clamp(slope == 0 ? 0 : offset / slope, 0.0, 1.0);
    for (const double share : {0.0, crossing, 1.0}) {
      const SkewnessCell here = mix(cell, next, share);
      const double distance =
          std::fabs(skewness - here.mean) / std::max(MonitoringCurve::deviation(here, periods), kFloor);
      if (!(distance < result.best_distance)) continue;
      result.best_distance = distance;
      result.best = from + share * span;
    }
  }
  return result;
}

/// The part of a range that the curve covers.
signal::NoiseRange within(const signal::NoiseRange& noise, const std::vector<double>& levels) {
  const double upper = std::isnan(noise.upper) ? levels.back() : noise.upper;
  return {std::clamp(noise.lower, levels.front(), levels.back()),
          std::clamp(upper, levels.front(), levels.back())};
}

/// The same at any noise of a range, in steps as fine as an eighth of the distance of the curve's levels.
Accepted accept(const MonitoringCurve& curve, double skewness, int periods, const signal::NoiseRange& noise) {
  Accepted result = accept(curve, skewness, periods, noise.upper);
  if (!(noise.lower < noise.upper)) return result;
  std::vector<double> others = {noise.lower};
  for (std::size_t i = 0; i + 1 < curve.noise_levels.size(); ++i)
    for (int step = 0; step < 8; ++step) {
      const double from = curve.noise_levels[i], other = from + (curve.noise_levels[i + 1] - from) * step / 8;
      if (other > noise.lower && other < noise.upper) others.push_back(other);
    }
  for (const double other : others) {
    const Accepted more = accept(curve, skewness, periods, other);
    if (more.pieces == 0) continue;
    if (result.pieces == 0) {
      result = more;
      continue;
    }
    result.lower = std::min(result.lower, more.lower);
    result.upper = std::max(result.upper, more.upper);
    result.pieces = std::max(result.pieces, more.pieces);
    result.touches_end |= more.touches_end;
    result.in_flagged_stretch |= more.in_flagged_stretch;
  }
  return result;
}

Estimate with_angle(Estimate estimate, const MonitoringCurve& curve) {
  estimate.backlash_angle = estimate.backlash * curve.backlash_to_angle;
  estimate.angle_lower = estimate.lower * curve.backlash_to_angle;
  estimate.angle_upper = estimate.upper * curve.backlash_to_angle;
  if (curve.conditions.angular)
    estimate.backlash = estimate.lower = estimate.upper = kNaN;  // no length known
  return estimate;
}

}  // namespace

SkewnessCell MonitoringCurve::at(double backlash, double noise) const {
  const auto place = locate(
      points.size(), [this](std::size_t i) { return points[i].backlash; }, backlash);
  const auto level = locate(
      noise_levels.size(), [this](std::size_t i) { return noise_levels[i]; }, noise);
  const auto cell = [this, &level](std::size_t i) {
    const auto& cells = points[i].cells;
    const std::size_t n = level.first;
    return n + 1 < cells.size() ? mix(cells[n], cells[n + 1], level.second) : cells[n];
  };
  const std::size_t p = place.first;
  return p + 1 < points.size() ? mix(cell(p), cell(p + 1), place.second) : cell(p);
}

double MonitoringCurve::deviation(const SkewnessCell& cell, int periods) {
  return std::sqrt(cell.between * cell.between + cell.within * cell.within / std::max(1, periods));
}

const SkewnessCell& MonitoringCurve::nominal(const CurvePoint& point) const {
  const auto level = std::lower_bound(noise_levels.begin(), noise_levels.end(), conditions.noise);
  return point.cells[level == noise_levels.end() ? noise_levels.size() - 1 : level - noise_levels.begin()];
}

bool MonitoringCurve::flat() const {
  double lowest = kInfinity, highest = -kInfinity;  // upper end of the lowest band, lower end of the highest
  for (const CurvePoint& point : points) {
    const SkewnessCell& cell = nominal(point);
    const double scatter = std::max(kFloor, coverage_factor * deviation(cell, conditions.periods));
    lowest = std::min(lowest, cell.mean + scatter);
    highest = std::max(highest, cell.mean - scatter);
  }
  return highest <= lowest;
}

void MonitoringCurve::finish(const std::vector<std::vector<SkewnessCell>>& middle) {
  std::vector<std::vector<SkewnessCell>> finished(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t level = 0; level < noise_levels.size(); ++level) {
      SkewnessCell cell = shared_scatter(points, middle, i, level);
      cell.between = std::hypot(cell.between, roughness(points, middle, i, level));
      finished[i].push_back(cell);
    }
  double lowest = 1e300;
  for (CurvePoint& point : points) {
    const SkewnessCell& cell = nominal(point);
    const double error = MonitoringCurve::deviation(cell, conditions.periods * conditions.seeds);
    point.monotonic = cell.mean <= lowest + 2 * error;
    lowest = std::min(lowest, cell.mean);
  }
  for (std::size_t i = 0; i < points.size(); ++i) points[i].cells = std::move(finished[i]);
}

Estimate MonitoringCurve::invert(double skewness, int periods, const signal::NoiseRange& range) const {
  Estimate estimate;
  estimate.method = "apd_skewness";
  estimate.skewness = skewness;
  std::string& text = estimate.message;
  text = fmt::format("skewness {:.4g} over {} period(s)", skewness, periods);
  if (flat()) {
    estimate.status = Status::ambiguous;
    text += "; on the curve the skewness of " + conditions.signal + " does not depend on backlash";
    estimate.lower = points.front().backlash;
    return with_angle(estimate, *this);
  }
  const signal::NoiseRange noise = within(range, noise_levels);
  const Accepted found = accept(*this, skewness, periods, noise);
  if (found.pieces == 0) {
    const double first = at(points.front().backlash, noise.lower).mean,
                 last = at(points.back().backlash, noise.upper).mean;
    const bool above_start = skewness > at(points.front().backlash, noise.upper).mean;
    estimate.status = above_start ? Status::below_range : Status::above_range;
    text += above_start ? fmt::format(" is higher than the curve at its smallest backlash ({:.4g})", first)
                        : fmt::format(" is lower than the curve anywhere ({:.4g})", last);
    if (!above_start) estimate.lower = points.back().backlash;
    return with_angle(estimate, *this);
  }
  const double span = points.back().backlash - points.front().backlash;
  estimate.lower = found.lower;
  if (!found.touches_end) estimate.upper = found.upper;
  if (found.upper - found.lower > 0.5 * span) {
    estimate.status = Status::ambiguous;
    text += " fits more than half of the curve";
  } else if (found.touches_end) {
    estimate.status = Status::above_range;
    text += " fits the end of the curve; backlash may be larger than it covers";
  } else {
    estimate.status = Status::ok;
    estimate.backlash = found.best;
    text += " on the curve of " + conditions.rig;
    if (found.pieces > 1 || found.in_flagged_stretch)
      text += "; the curve is not monotonic here, the interval covers all branches";
  }
  return with_angle(estimate, *this);
}

}  // namespace backlash::diagnosis
