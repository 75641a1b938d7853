#include "backlash_diagnosis/diagnosis/apd_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace backlash {
namespace {

// Root of the smallest distance over the largest of the simulated records that may still be by chance.
constexpr double kMisfit = 2;
constexpr int kNoiseSteps = 5;  // where only bounds of the noise are known

/// Samples of the complete periods.
std::vector<double> samples_of(const Record& record, const ApdResult& apd, Channel signal) {
  std::vector<double> samples;
  const std::vector<double>& values = record.column(signal);
  std::size_t i = 0;
  for (const PeriodResult& period : apd.periods) {
    while (i < record.size() && record.time[i] < period.start) ++i;
    for (; i < record.size() && record.time[i] < period.end; ++i)
      if (std::isfinite(values[i])) samples.push_back(values[i]);
  }
  return samples;
}

std::vector<double> noises_of(const NoiseRange& range, const std::vector<double>& levels) {
  const double upper = std::min(std::isnan(range.upper) ? levels.back() : range.upper, levels.back());
  const double lower = std::min(range.lower, upper);
  if (lower == upper) return {upper};
  std::vector<double> noises;
  for (int step = 0; step < kNoiseSteps; ++step)
    noises.push_back(lower + (upper - lower) * step / (kNoiseSteps - 1));
  return noises;
}

/// Value at the noise levels on both sides of `noise`, the larger one.
double larger(const std::vector<double>& values, const std::vector<double>& levels, double noise) {
  const auto above = std::lower_bound(levels.begin(), levels.end(), noise);
  const auto upper = std::min(above - levels.begin(), static_cast<std::ptrdiff_t>(levels.size()) - 1);
  return std::max(values[upper], values[std::max<std::ptrdiff_t>(0, upper - 1)]);
}

struct Match {
  double misfit = std::numeric_limits<double>::infinity();  // root of the smallest distance
  double usual = 0;                                         // largest of the simulated records there
  double backlash = kNaN, lower = kNaN, upper = kNaN;
  bool touches_end = false;
};

class Matcher {
 public:
  Matcher(const MonitoringCurve& curve, const Quantiles& observed, const NoiseRange& noise) : curve_(curve) {
    for (const double sigma : noises_of(noise, curve.noise_levels))
      fits_.emplace_back(sigma, FamilyDistance(curve.family->members_with_noise(sigma), observed));
  }

  Match match() const {
    Match match;
    double smallest = std::numeric_limits<double>::infinity();
    for (const auto& [sigma, fit] : fits_) {
      const FamilyDistance::Place& best = fit.smallest();
      if (!(best.distance < smallest)) continue;
      smallest = best.distance;
      match.misfit = std::sqrt(smallest);
      match.usual = larger(curve_.family->segments[best.segment].misfit, curve_.noise_levels, sigma);
      match.backlash = backlash(best.segment, best.share);
    }
    for (const auto& [sigma, fit] : fits_) accept(sigma, fit, smallest, match);
    return match;
  }

 private:
  double backlash(std::size_t segment, double share) const {
    const double from = curve_.points[segment].backlash;
    return from + share * (curve_.points[segment + 1].backlash - from);
  }

  void accept(double sigma, const FamilyDistance& fit, double smallest, Match& match) const {
    const auto& segments = curve_.family->segments;
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const double threshold = larger(segments[i].threshold, curve_.noise_levels, sigma);
      const double limit = smallest + threshold * std::max(smallest, segments[i].floor);
      for (const auto& [begin, end] : fit.within(i, limit)) {
        match.lower = std::fmin(match.lower, backlash(i, begin));
        match.upper = std::fmax(match.upper, backlash(i, end));
        match.touches_end |= i + 1 == segments.size() && end == 1;
      }
    }
  }

  const MonitoringCurve& curve_;
  std::vector<std::pair<double, FamilyDistance>> fits_;  // by noise
};

Estimate answer(const Match& match, const MonitoringCurve& curve, const ApdResult& apd) {
  Estimate estimate;
  std::ostringstream text;
  text.precision(3);
  text << "rms distance " << match.misfit << " from the nearest distribution of " << curve.conditions.rig;
  estimate.lower = match.lower;
  if (!match.touches_end) estimate.upper = match.upper;
  if (match.misfit > kMisfit * match.usual) {
    estimate.status = Status::out_of_domain;
    estimate.lower = estimate.upper = kNaN;
    text << ", simulated records were within " << match.usual
         << ": the machine does something that the rig does not contain";
  } else if (match.upper - match.lower > 0.5 * (curve.points.back().backlash - curve.points.front().backlash)) {
    estimate.status = Status::ambiguous;
    text << "; more than half of the curve fits";
  } else if (match.touches_end) {
    estimate.status = Status::above_range;
    text << "; the end of the curve fits, backlash may be larger than it covers";
  } else {
    estimate.status = Status::ok;
    estimate.backlash = match.backlash;
    text << ", over " << apd.periods.size() << " period(s)";
  }
  estimate.message = text.str();
  return estimate;
}

}  // namespace

Estimate estimate_apd_shape(const Record& record, const ApdResult& apd, const ApdSettings& settings,
                            const MonitoringCurve* curve) {
  Estimate estimate;
  if (const auto refused = refuse_for_curve(record, apd, settings, curve)) {
    estimate = *refused;
  } else if (!curve->family) {
    estimate.message = "the curve has no family of distributions; build it anew";
  } else {
    const Quantiles observed = quantiles_of(samples_of(record, apd, settings.signal));
    estimate = answer(Matcher(*curve, observed, apd.noise_range).match(), *curve, apd);
  }
  estimate.method = "apd_shape";
  estimate.skewness = apd.skewness;
  estimate.backlash_angle = estimate.backlash * (curve ? curve->backlash_to_angle : kNaN);
  estimate.angle_lower = estimate.lower * (curve ? curve->backlash_to_angle : kNaN);
  estimate.angle_upper = estimate.upper * (curve ? curve->backlash_to_angle : kNaN);
  return estimate;
}

}  // namespace backlash
