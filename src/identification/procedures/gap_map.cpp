// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/gap_map.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/procedures/harmonics.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/blocks.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/spectrum.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

constexpr double kTurn = 2 * M_PI;
constexpr double kSteady = 0.05;     // choice: of the median speed
constexpr double kSettled = 5e-3;    // choice: of the median speed: the filter's own at the ends of a run
constexpr double kMostStart = 0.25;  // choice: of a run, for starting and for stopping
constexpr double kSpeedCutoff = 5;   // Hz, choice: of the speed that is judged
constexpr double kBackwards =
    0.01;                         // choice: share of samples that may go the other way: starting and stopping
constexpr int kLeastSamples = 5;  // choice: per bin and direction
constexpr double kRelevant = 1e-3;  // choice: of the mean: smaller harmonics may be the steps of the sensors
constexpr double kLopsided = 0.1;   // choice: of the bin's width
constexpr int kLeastBins = 8;       // theory: three unknowns per harmonic
constexpr int kCentreOrders = 6;    // choice: of the centre line beside the scale

using Values = std::vector<double>;

/// The steady part of a run.
struct Run {
  Values load, difference;  // rad
  double speed = 0;         // rad/s
  signal::Measured scale;
};

Run steady_part(const record::Record& given) {
  if (!given.has(record::Channel::motor_position) || !given.has(record::Channel::load_position))
    throw CannotIdentify(given.name + ": a gap map needs the positions of motor and load");
  const record::Record record = record::evenly_sampled(given);
  const Values &motor = record.column(record::Channel::motor_position),
               &load = record.column(record::Channel::load_position);
  const double interval = record.sampling_interval();
  const Values speed =
      signal::derivative(signal::low_pass(load, interval, std::min(kSpeedCutoff, 0.2 / interval)), interval);
  Run run;
  run.speed = signal::median(speed);
  const auto [from, to] = signal::steady_range(speed, kMostStart, kSettled);
  int backwards = 0;
  for (std::size_t i = 0; i < speed.size(); ++i) {
    backwards += speed[i] * run.speed < -kSteady * run.speed * run.speed;
    if (i < from || i >= to || std::fabs(speed[i] - run.speed) > kSteady * std::fabs(run.speed)) continue;
    run.load.push_back(load[i]);
    run.difference.push_back(motor[i] - load[i]);
  }
  if (backwards > kBackwards * double(speed.size()))
    throw CannotIdentify(
        fmt::format("{}: the speed reverses: {} of {} samples go against the median of {:.3g} rad/s",
                    record.name, backwards, speed.size(), run.speed));
  if (run.load.size() < 100 || 2 * run.load.size() < to - from || run.speed == 0)
    throw CannotIdentify(fmt::format("{}: only {} of {} samples within 5 % of the median speed", record.name,
                                     run.load.size(), to - from));
  return run;
}

/// Means over lengths of `width` along the travel, not wrapped: position, motor minus load.
std::vector<std::pair<double, double>> averaged(const Run& run, double width) {
  struct Sum {
    double load = 0, difference = 0;
    int count = 0;
  };
  std::map<long, Sum> sums;
  for (std::size_t i = 0; i < run.load.size(); ++i) {
    Sum& sum = sums[std::lround(run.load[i] / width)];
    sum.load += run.load[i];
    sum.difference += run.difference[i];
    ++sum.count;
  }
  std::vector<std::pair<double, double>> means;
  for (const auto& [place, sum] : sums) means.emplace_back(sum.load / sum.count, sum.difference / sum.count);
  return means;
}

/// Slope of motor over load position. Over a turn and more the centre line repeats and is separated from the
/// slope by its first orders; over less they are one.
void measure_scale(Run& run, double width) {
  const auto means = averaged(run, width);
  const double travel = means.back().first - means.front().first;
  const int orders = travel > kTurn - 2 * width ? kCentreOrders : 0;
  Eigen::MatrixXd a(means.size(), 2 + 2 * orders);
  Eigen::VectorXd b(means.size());
  for (std::size_t i = 0; i < means.size(); ++i) {
    const auto row = Eigen::Index(i);
    a(row, 0) = 1;
    a(row, 1) = (means[i].first - means.front().first) / travel - 0.5;
    for (int n = 1; n <= orders; ++n) {
      a(row, 2 * n) = std::sin(n * means[i].first);
      a(row, 2 * n + 1) = std::cos(n * means[i].first);
    }
    b[row] = means[i].second;
  }
  const signal::LeastSquaresFit fit = signal::fit_linear(a, b);
  const signal::Measured slope = fit.parameter(1);
  const double root = std::sqrt(signal::correlation_length({fit.residuals.begin(), fit.residuals.end()}));
  run.scale = {1 + slope.value / travel, root * slope.standard_error / travel};
}

/// One run in the bins of a turn.
struct Binned {
  std::map<int, signal::Measured> value;  // at the middle of the bin
  std::map<int, int> samples;
  std::map<int, double> place;  // rad, mean load position, turns not taken off
};

/// The line through the samples of a bin; nothing where they are too few or all at one place.
signal::LeastSquaresFit line_in_bin(const std::vector<int>& members, const Values& offset, const Values& y) {
  Eigen::MatrixXd a(members.size(), 2);
  Eigen::VectorXd b(members.size());
  for (std::size_t i = 0; i < members.size(); ++i) {
    a.row(Eigen::Index(i)) << 1, offset[members[i]];
    b[Eigen::Index(i)] = y[members[i]];
  }
  return signal::fit_linear(a, b);
}

/// `level` and `slope` are taken off: y = d - level - slope q.
Binned bin_run(const Run& run, double level, double slope, int bins) {
  const double width = kTurn / bins;
  std::map<int, std::vector<int>> members;
  Values offset(run.load.size()), y(run.load.size()), residual(run.load.size(), 0.0);
  for (std::size_t i = 0; i < run.load.size(); ++i) {
    const double turned = run.load[i] - kTurn * std::floor(run.load[i] / kTurn);
    const int bin = std::min(bins - 1, int(turned / width));
    offset[i] = turned - (bin + 0.5) * width;
    y[i] = run.difference[i] - level - slope * run.load[i];
    members[bin].push_back(int(i));
  }
  Binned binned;
  for (const auto& [bin, list] : members) {
    if (int(list.size()) < kLeastSamples) continue;
    double middle = 0;
    for (const int i : list) middle += offset[i] / double(list.size());
    if (std::fabs(middle) > kLopsided * width)
      continue;  // a line to the middle would reach beyond its samples
    try {
      const signal::LeastSquaresFit fit = line_in_bin(list, offset, y);
      binned.value[bin] = fit.parameter(0);
      binned.samples[bin] = int(list.size());
      for (const int i : list) binned.place[bin] += run.load[i] / double(list.size());
      for (std::size_t i = 0; i < list.size(); ++i) residual[list[i]] = fit.residuals[Eigen::Index(i)];
    } catch (const CannotIdentify&) {
      continue;
    }
  }
  const double root = std::sqrt(signal::correlation_length(residual));
  for (auto& [bin, value] : binned.value) value.standard_error *= root;
  return binned;
}

std::vector<GapBin> common_bins(const Binned& forward, const Binned& reverse, int bins) {
  std::vector<GapBin> common;
  for (const auto& [bin, f] : forward.value) {
    const auto other = reverse.value.find(bin);
    if (other == reverse.value.end()) continue;
    const signal::Measured& r = other->second;
    GapBin b;
    b.position = (bin + 0.5) * kTurn / bins;
    b.forward_samples = forward.samples.at(bin);
    b.reverse_samples = reverse.samples.at(bin);
    b.forward = f;
    b.reverse = r;
    const double error = std::hypot(f.standard_error, r.standard_error);
    b.separation = {f.value - r.value, error};
    b.centre = {0.5 * (f.value + r.value), 0.5 * error};
    common.push_back(b);
  }
  if (int(common.size()) < kLeastBins)
    throw CannotIdentify(fmt::format("the runs share only {} of {} bins of load position; {} are needed",
                                     common.size(), bins, kLeastBins));
  return common;
}

void fit_series(GapMap& map, const GapMapSettings& settings) {
  std::vector<int> orders;
  for (int n = 1; n <= settings.highest_order; ++n)
    if (n * map.coverage >= 0.999) orders.push_back(n);
  Values angle, separation;  // equal weight for every bin, whatever time was spent in it
  for (const GapBin& b : map.bins) {
    angle.push_back(b.position);
    separation.push_back(b.separation.value);
  }
  const HarmonicSeries series = fit_harmonics(angle, separation, orders, settings.false_alarm);
  map.mean_separation = series.mean;
  map.deviation = series.deviation;
  for (const Harmonic& h : series.harmonics)
    if (h.amplitude.value > kRelevant * map.mean_separation.value) map.harmonics.push_back(h);
  map.varies = !map.harmonics.empty();
  map.confidence = 1 - series.chance;
}

double relative(const signal::Measured& m) {
  return std::isfinite(m.standard_error) ? m.standard_error / m.value : 0;
}

void correct_wind_up(GapMap& map, const GapMapSettings& s) {
  const signal::Measured &f = s.friction_forward, &r = s.friction_reverse, &k = s.stiffness;
  if (!std::isfinite(k.value) || !std::isfinite(f.value) || !std::isfinite(r.value)) {
    map.warnings.emplace_back("without stiffness and load friction the wind-up of the mesh stays in the gap");
    return;
  }
  const auto error = [](const signal::Measured& m) {
    return std::isfinite(m.standard_error) ? m.standard_error : 0;
  };
  const double torque = f.value + r.value;
  map.wind_up.value = torque / k.value;
  map.wind_up.standard_error =
      std::hypot(std::hypot(error(f), error(r)) / k.value, map.wind_up.value * relative(k));
  map.mean_gap = {map.mean_separation.value - map.wind_up.value,
                  std::hypot(map.mean_separation.standard_error, map.wind_up.standard_error)};
}

void say(GapMap& map) {
  const double mean = std::isfinite(map.mean_gap.value) ? map.mean_gap.value : map.mean_separation.value;
  if (map.varies) {
    double lowest = mean, highest = mean;
    for (int i = 0; i < 720; ++i) {
      const double g = map.gap_at(i * kTurn / 720);
      lowest = std::min(lowest, g);
      highest = std::max(highest, g);
    }
    map.statement = fmt::format(
        "the gap varies with load position between {:.3g} and {:.3g} rad, {:.3g} % of its mean (confidence "
        "{:.3g} %)",
        lowest, highest, 100 * (highest - lowest) / mean, 100 * map.confidence);
  } else {
    // Amplitude that one harmonic would have to have: 3 standard errors of sqrt(2 / bins) deviations.
    map.statement = fmt::format(
        "no variation of the gap with load position is found; one below {:.3g} rad would not be seen",
        std::max(3 * map.deviation * std::sqrt(2.0 / double(map.bins.size())),
                 kRelevant * map.mean_separation.value));
  }
}

void check(const GapMapSettings& s) {
  if (s.bins < 8 || s.bins > 3600) throw InvalidParameter("bins", s.bins, "must be 8 to 3600");
  if (s.highest_order < 0 || s.highest_order > s.bins / 4)
    throw InvalidParameter("highest_order", s.highest_order, "must be 0 to a quarter of the bins");
  if (!(s.false_alarm >= 1e-6 && s.false_alarm <= 0.5))
    throw InvalidParameter("false_alarm", s.false_alarm, "must be 1e-6 to 0.5");
  if (s.stiffness.value <= 0) throw InvalidParameter("stiffness", s.stiffness.value, "must be > 0");
  for (const signal::Measured& f : {s.friction_forward, s.friction_reverse})
    if (f.value < 0) throw InvalidParameter("friction", f.value, "must be >= 0");
}

}  // namespace

double GapMap::gap_at(double position) const {
  double gap = std::isfinite(mean_gap.value) ? mean_gap.value : mean_separation.value;
  for (const Harmonic& h : harmonics) gap += h.amplitude.value * std::sin(h.order * position + h.phase.value);
  return gap;
}

GapMap identify_gap_map(const record::Record& one_way, const record::Record& other_way,
                        const GapMapSettings& settings) {
  check(settings);
  Run forward = steady_part(one_way), reverse = steady_part(other_way);
  if (forward.speed < 0) std::swap(forward, reverse);
  if (!(forward.speed > 0 && reverse.speed < 0))
    throw CannotIdentify(
        fmt::format("both runs go one way ({:.3g} and {:.3g} rad/s): a gap map needs one each way",
                    forward.speed, reverse.speed));
  const double width = kTurn / settings.bins;
  GapMap map;
  measure_scale(forward, width);
  measure_scale(reverse, width);
  map.forward_speed = forward.speed;
  map.reverse_speed = reverse.speed;
  map.scale_forward = forward.scale;
  map.scale_reverse = reverse.scale;
  map.scale = {0.5 * (forward.scale.value + reverse.scale.value),
               0.5 * std::hypot(forward.scale.standard_error, reverse.scale.standard_error)};
  const double slope = map.scale.value - 1;
  const auto level_of = [&](const Run& run) {
    double sum = 0;
    for (std::size_t i = 0; i < run.load.size(); ++i) sum += run.difference[i] - slope * run.load[i];
    return sum / double(run.load.size());
  };
  const double level = 0.5 * (level_of(forward) + level_of(reverse));
  const Binned forward_bins = bin_run(forward, level, slope, settings.bins);
  const Binned reverse_bins = bin_run(reverse, level, slope, settings.bins);
  map.bins = common_bins(forward_bins, reverse_bins, settings.bins);
  map.coverage = double(map.bins.size()) / settings.bins;
  if (map.coverage < 0.999)
    map.warnings.push_back(fmt::format(
        "both runs together cover {:.3g} % of the turn: the map holds only there", 100 * map.coverage));
  fit_series(map, settings);
  // Runs from one start to opposite ends lie a turn apart, and the scale over that distance is part of the
  // gap.
  double apart = 0;
  for (const auto& [bin, place] : forward_bins.place)
    if (const auto other = reverse_bins.place.find(bin); other != reverse_bins.place.end())
      apart += (place - other->second) / double(map.bins.size());
  map.mean_separation.standard_error =
      std::hypot(map.mean_separation.standard_error, apart * map.scale.standard_error);
  correct_wind_up(map, settings);
  say(map);
  return map;
}

}  // namespace backlash::identification
