// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/wall_reading.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::diagnosis {
namespace {

constexpr double kPeak = 0.95;  // quantile, past peaks of noise

struct Line {
  double mean = 0, slope = 0, rms = 0;  // slope per sample, rms of the residual
};

Line fit_line(const std::vector<double>& values, std::size_t begin, std::size_t end) {
  Line line;
  const double n = static_cast<double>(end - begin), middle = 0.5 * (n - 1);
  if (n < 1) return line;
  for (std::size_t i = begin; i < end; ++i) line.mean += values[i] / n;
  double xy = 0, xx = 0, yy = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const double x = static_cast<double>(i - begin) - middle, y = values[i] - line.mean;
    xy += x * y;
    xx += x * x;
    yy += y * y;
  }
  if (xx > 0) line.slope = xy / xx;
  if (n > 2) line.rms = std::sqrt(std::max(0.0, yy - line.slope * xy) / (n - 2));
  return line;
}

struct Moments {
  double mean = 0, deviation = 0;
};

// Hann weights suppress ringing whose phase at the ends of the window is arbitrary, and torque noise at the
// end of the excursion, which the noise itself has picked.
Moments hann_moments(const std::vector<double>& values, std::size_t begin, std::size_t end) {
  const double pi = std::acos(-1.0), n = static_cast<double>(end - begin);
  double weight_sum = 0, weighted = 0, sum = 0, squares = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const double weight = 1 - std::cos(2 * pi * static_cast<double>(i - begin + 1) / (n + 1));
    const double value = values[i] - values[begin];
    weight_sum += weight;
    weighted += weight * value;
    sum += value / n;
    squares += value * value;
  }
  return {values[begin] + weighted / weight_sum, std::sqrt(std::max(0.0, squares / n - sum * sum))};
}

std::vector<double> side_torque(const std::vector<double>& torque, const TorqueExcursion& excursion) {
  std::vector<double> values;
  for (std::size_t i = excursion.begin; i < excursion.end; ++i) values.push_back(excursion.side * torque[i]);
  return values;
}

// Contiguous part of [begin, end) with the largest sum of side * torque - level.
TorqueExcursion largest_stretch(const std::vector<double>& torque, int side, double level, std::size_t begin,
                                std::size_t end, double& largest) {
  TorqueExcursion best{side, begin, begin};
  largest = 0;
  double sum = 0;
  std::size_t start = begin;
  for (std::size_t i = begin; i < end; ++i) {
    sum += side * torque[i] - level;
    if (sum <= 0) {
      sum = 0;
      start = i + 1;
    } else if (sum > largest) {
      largest = sum;
      best.begin = start;
      best.end = i + 1;
    }
  }
  return best;
}

}  // namespace

std::vector<TorqueExcursion> find_excursions(const std::vector<double>& torque, double level) {
  // The sum over an excursion must stand out of the noise: 8 standard deviations of one sample.
  const double least_sum = torque.size() < 3 ? 0 : 8 * signal::noise_from_differences(torque, 2);
  std::vector<TorqueExcursion> excursions;
  int side = 0;
  std::size_t begin = 0;
  const auto close = [&](std::size_t end) {
    double sum = 0;
    const TorqueExcursion found = largest_stretch(torque, side, level, begin, end, sum);
    if (found.end < torque.size() && sum > least_sum) excursions.push_back(found);
  };
  for (std::size_t i = 0; i < torque.size(); ++i) {
    const int now = torque[i] > 0.5 * level ? 1 : torque[i] < -0.5 * level ? -1 : 0;
    if (now == 0 || now == side) continue;
    if (side != 0) close(i);
    side = now;
    begin = i;
  }
  if (side != 0) close(torque.size());
  return excursions;
}

WallReading read_wall(const LockedMotion& motion, const TorqueExcursion& excursion, double level,
                      double torque_span, std::size_t limit) {
  const std::size_t end = excursion.end, length = end - excursion.begin;
  const std::size_t fewest = std::min<std::size_t>(length, 4), third = std::max(fewest, length / 3);
  const auto change_within = [&](std::size_t from) {
    return std::abs(fit_line(motion.torque, from, from + third).slope) * static_cast<double>(third);
  };
  const auto window_for = [&](double change) {
    if (change <= torque_span) return third;
    return std::max(fewest, static_cast<std::size_t>(static_cast<double>(third) * torque_span / change));
  };

  WallReading reading;
  reading.torque_change = change_within(end - third);
  reading.side = excursion.side;
  const std::size_t window = window_for(reading.torque_change), begin = end - window;
  reading.arrival = hann_moments(motion.position, excursion.begin,
                                 excursion.begin + window_for(change_within(excursion.begin)))
                        .mean;
  reading.peak = signal::quantile(side_torque(motion.torque, excursion), kPeak);
  reading.time = 0.5 * (motion.time[begin] + motion.time[end - 1]);
  reading.held = motion.time[end - 1] - motion.time[excursion.begin];
  reading.torque = excursion.side * hann_moments(motion.torque, begin, end).mean;
  if (!motion.sensor.empty()) reading.sensor = excursion.side * hann_moments(motion.sensor, begin, end).mean;
  const Moments last = hann_moments(motion.position, begin, end);
  const std::size_t shift = std::min(window / 2, begin - excursion.begin);
  const Moments earlier = hann_moments(motion.position, begin - shift, end - shift);
  reading.position = last.mean;
  reading.spread = last.deviation;
  reading.earlier_position = earlier.mean;
  reading.earlier_spread = earlier.deviation;

  double sum = 0;
  const TorqueExcursion return_part =
      largest_stretch(motion.torque, excursion.side, 0.5 * level, begin, std::max(limit, end), sum);
  reading.ringing = fit_line(motion.position, begin, std::max(return_part.end, end)).rms;
  return reading;
}

}  // namespace backlash::diagnosis
