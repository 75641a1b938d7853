// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/trend.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/error_memory.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/robust.h"
#include "backlash_diagnosis/signal/sen_slope.h"
#include "trend_message.h"

namespace backlash::diagnosis {
namespace {

constexpr std::size_t kStretches = 400;

/// A line about the mean time of its points.
struct Line {
  double middle = 0, level = 0, level_error = 0;  // s; unit: at `middle`; half of its 95 % interval
  double rate = 0, lower = kNaN, upper = kNaN;    // unit per s

  double at(double time) const { return level + rate * (time - middle); }
};

std::vector<TrendPoint> sorted(std::vector<TrendPoint> points) {
  points.erase(
      std::remove_if(points.begin(), points.end(),
                     [](const TrendPoint& p) { return !std::isfinite(p.time) || !std::isfinite(p.value); }),
      points.end());
  std::stable_sort(points.begin(), points.end(),
                   [](const TrendPoint& a, const TrendPoint& b) { return a.time < b.time; });
  return points;
}

/// Medians of time and value over equal stretches of time, where there are more points than that.
std::vector<TrendPoint> thinned(const std::vector<TrendPoint>& points) {
  if (points.size() <= kStretches) return points;
  const double start = points.front().time, stretch = (points.back().time - start) / kStretches;
  std::vector<TrendPoint> medians;
  for (std::size_t i = 0, k = 1; i < points.size(); ++k) {
    std::vector<double> times, values;
    for (;
         i < points.size() && (k >= kStretches || points[i].time < start + stretch * static_cast<double>(k));
         ++i) {
      times.push_back(points[i].time);
      values.push_back(points[i].value);
    }
    if (!times.empty())
      medians.push_back({signal::median(std::move(times)), signal::median(std::move(values))});
  }
  return medians;
}

std::size_t different_times(const std::vector<TrendPoint>& points) {
  std::size_t count = points.empty() ? 0 : 1;
  for (std::size_t i = 1; i < points.size(); ++i) count += points[i].time > points[i - 1].time;
  return count;
}

Line fit(const std::vector<TrendPoint>& points) {
  std::vector<double> times, values;
  for (const TrendPoint& p : points) {
    times.push_back(p.time);
    values.push_back(p.value);
  }
  Line line;
  for (const double time : times) line.middle += (time - times.front()) / static_cast<double>(times.size());
  line.middle += times.front();
  const signal::SenSlope slope(times, values);
  line.rate = slope.value();
  std::vector<double> residuals;
  double largest = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    residuals.push_back(values[i] - line.rate * (times[i] - line.middle));
    largest = std::max(largest, std::abs(values[i]));
  }
  const signal::RobustScale scale = signal::robust_scale(residuals, signal::smallest_step(values));
  line.level = scale.centre;
  signal::ErrorMemory memory;
  if (scale.deviation > 1e-12 * largest) {  // else on a line but for rounding
    for (double& r : residuals) r = std::clamp(r - scale.centre, -scale.clip, scale.clip);
    memory = signal::error_memory(times, residuals);
  }
  const signal::SenSlope::Interval interval = slope.interval(memory.slope);
  line.lower = interval.lower;
  line.upper = interval.upper;
  // Variance of a median of normal errors: pi / 2 of that of the mean.
  line.level_error = signal::kNormalQuantile975 * scale.deviation *
                     std::sqrt(0.5 * M_PI * memory.level / static_cast<double>(times.size()));
  return line;
}

/// Where the line's upper (`side` 1) or lower (-1) confidence bound crosses a value, in s from the middle:
/// the root of rate u + side sqrt(error^2 + (half u)^2) = distance, which Fieller's (1954) quadratic gives.
/// Half the interval of the rate, `half`, is that of the side that counts.
double bound_crossing(const Line& line, double distance, double side) {
  const bool later = distance > side * line.level_error;
  const double half = later == (side > 0) ? line.upper - line.rate : line.rate - line.lower;
  const double a = line.rate * line.rate - half * half, b = line.rate * distance,
               c = distance * distance - line.level_error * line.level_error;
  const double root = std::sqrt(std::max(b * b - a * c, 0.0));
  // (b -+ root) / a without cancellation
  if (b * side >= 0) return b + side * root != 0 ? c / (b + side * root) : 0;
  return (b - side * root) / a;
}

Trend::Crossing crossing(const Line& line, double limit) {
  const double distance = limit - line.level;
  return {line.middle + distance / line.rate, line.middle + bound_crossing(line, distance, 1),
          line.middle + bound_crossing(line, distance, -1)};
}

}  // namespace

Trend find_trend(std::vector<TrendPoint> points, std::optional<double> limit, bool angular) {
  points = sorted(std::move(points));
  Trend trend;
  trend.points = points.size();
  if (!points.empty()) {
    trend.time = points.back().time;
    trend.span = trend.time - points.front().time;
  }
  const std::vector<TrendPoint> few = thinned(points);
  const std::size_t times = different_times(few);
  if (times >= kFewestTimes && trend.span >= kShortestSpan) {
    const Line line = fit(few);
    trend.rate = line.rate;
    trend.rate_lower = line.lower;
    trend.rate_upper = line.upper;
    trend.known = std::isfinite(line.lower);
    trend.grows = line.lower > 0;
    trend.level = line.at(trend.time);
    if (limit && trend.grows) trend.reaches = crossing(line, *limit);
  } else {
    std::vector<double> values;
    for (const TrendPoint& p : few) values.push_back(p.value);
    trend.level = signal::median(std::move(values));
  }
  trend.exceeded = limit && trend.level >= *limit;
  if (trend.exceeded && !trend.grows) trend.reaches = Trend::Crossing{kNaN, kNaN, trend.time};
  trend.message = trend_message(trend, times, limit, angular);
  return trend;
}

std::vector<TrendPoint> trend_points(const std::vector<HistoryEntry>& entries, bool angular,
                                     const std::string& rig_digest) {
  const auto baseline = std::find_if(entries.rbegin(), entries.rend(),
                                     [](const HistoryEntry& e) { return e.event == kBaselineEvent; });
  std::vector<TrendPoint> points;
  for (auto entry = baseline.base(); entry != entries.end(); ++entry) {
    const double value = angular ? entry->backlash_angle : entry->backlash;
    if (entry->rig_digest == rig_digest && std::isfinite(value)) points.push_back({entry->time, value});
  }
  return points;
}

}  // namespace backlash::diagnosis
