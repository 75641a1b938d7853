// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/family_match.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

namespace backlash::diagnosis {
namespace {

constexpr int kMostNoises = 5;       // where only bounds of the noise are known
constexpr double kNoiseRatio = 1.2;  // of neighbours among them, if that needs no more

std::vector<double> noises_of(const signal::NoiseRange& range, const std::vector<double>& levels) {
  const double upper = std::min(std::isnan(range.upper) ? levels.back() : range.upper, levels.back());
  const double lower = std::min(range.lower, upper);
  if (lower == upper) return {upper};
  const double ratios =
      std::log(upper / lower) / std::log(kNoiseRatio);  // infinite where the lower bound is zero
  const int steps = static_cast<int>(std::ceil(std::min(ratios, kMostNoises - 1.0)));
  std::vector<double> noises;
  for (int step = 0; step <= steps; ++step) noises.push_back(lower + (upper - lower) * step / steps);
  return noises;
}

/// Value at `noise`, linear between the levels and constant outside of them.
double interpolated(const std::vector<double>& values, const std::vector<double>& levels, double noise) {
  const auto above = std::lower_bound(levels.begin(), levels.end(), noise) - levels.begin();
  if (above == 0) return values.front();
  if (above == static_cast<std::ptrdiff_t>(levels.size())) return values.back();
  const double share = (noise - levels[above - 1]) / (levels[above] - levels[above - 1]);
  return values[above - 1] + share * (values[above] - values[above - 1]);
}

/// A point of the curve's backlash axis, segment + share; the end of the curve for all beyond it.
double backlash_at(const MonitoringCurve& curve, std::size_t segment, double share) {
  if (segment + 1 >= curve.points.size()) return curve.points.back().backlash;
  const double from = curve.points[segment].backlash;
  return from + share * (curve.points[segment + 1].backlash - from);
}

/// What was learnt about a segment; beyond the curve that of the last one.
const FamilySegment& segment_of(const MonitoringCurve& curve, std::size_t segment) {
  const auto& segments = curve.family->segments;
  return segments[std::min(segment, segments.size() - 1)];
}

/// Widens the interval by all that is accepted at one noise; `smallest` is the record's distance.
void accept(const MonitoringCurve& curve, const FamilyDistance& fit, double noise, double smallest,
            FamilyMatch& match) {
  const std::size_t on_curve = curve.family->segments.size();
  for (std::size_t i = 0; i + 1 < curve.family->members.size(); ++i) {
    const FamilySegment& segment = segment_of(curve, i);
    const double threshold = interpolated(segment.threshold, curve.noise_levels, noise);
    for (const auto& [begin, end] : fit.within(i, smallest + threshold * std::max(smallest, segment.floor))) {
      match.lower = std::fmin(match.lower, backlash_at(curve, i, begin));
      match.upper = std::fmax(match.upper, backlash_at(curve, i, end));
      match.touches_end |= i >= on_curve || (i + 1 == on_curve && end == 1);
    }
  }
}

}  // namespace

FamilyMatch match_family(const MonitoringCurve& curve, std::vector<double> samples,
                         const signal::NoiseRange& noise) {
  const Quantiles observed = quantiles_of(std::move(samples));
  std::vector<std::pair<double, FamilyDistance>> fits;  // by noise
  std::shared_ptr<const NoisyFamily> family;
  for (const double sigma : noises_of(noise, curve.noise_levels)) {
    auto next = curve.family->compared->at(*curve.family, sigma);
    fits.emplace_back(sigma, next == family ? fits.back().second : FamilyDistance(*next, observed));
    family = std::move(next);
  }
  FamilyMatch match;
  double smallest = std::numeric_limits<double>::infinity();
  for (const auto& [sigma, fit] : fits) {
    const FamilyDistance::Place& best = fit.smallest();
    if (!(best.distance < smallest)) continue;
    smallest = best.distance;
    match.backlash = backlash_at(curve, best.segment, best.share);
    match.usual_misfit = interpolated(segment_of(curve, best.segment).misfit, curve.noise_levels, sigma);
  }
  match.misfit = std::sqrt(smallest);
  for (const auto& [sigma, fit] : fits) accept(curve, fit, sigma, smallest, match);
  return match;
}

}  // namespace backlash::diagnosis
