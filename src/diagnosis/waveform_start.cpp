// SPDX-License-Identifier: BSD-3-Clause
#include "waveform_start.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::diagnosis {
namespace {

// All choices, tried on simulated machines.
constexpr double kStep = 1e-5;                                       // of the level
constexpr double kSpread[kStartValues] = {0.4, 0.4, 0.2, 0.2, 0.4};  // of the level
constexpr double kGaps = 6;         // twists of the sensor, how far off the position's zero may be
constexpr int kFewestForSpeed = 4;  // samples

/// Of the sensor, N m towards the flank that is loaded before the reversal: their mean where that does not
/// change, else the first one.
double load_before(const WaveformData& data, const WaveformWindow& window) {
  const auto first = static_cast<std::size_t>(window.first);
  if (!window.drive.empty()) return std::max(0.0, window.side * data.torque[first]);
  const auto reversal = static_cast<int>(std::lround(window.reversal / data.grid.interval));
  double mean = 0;
  for (int i = 0; i < reversal; ++i) mean += data.torque[first + static_cast<std::size_t>(i)] / reversal;
  return std::max(0.0, window.side * mean);
}

double moved_inertia(const WaveformSettings& s) {
  return s.motor_inertia + s.pinion_inertia + (std::isnan(s.gear_inertia) ? 0 : s.gear_inertia) +
         s.link_inertia;
}

/// Speed at the first sample, rad/s, by a parabola through the samples before the reversal.
double first_speed(const WaveformData& data, const WaveformWindow& window) {
  const double dt = data.grid.interval;
  const int count = std::max(kFewestForSpeed, static_cast<int>(std::lround(window.reversal / dt)));
  Eigen::MatrixXd basis(count, 3);
  Eigen::VectorXd position(count);
  for (int i = 0; i < count; ++i) {
    basis.row(i) << 1, i, i * i;
    position[i] = data.position[static_cast<std::size_t>(window.first) + static_cast<std::size_t>(i)];
  }
  return signal::solve_symmetric(signal::gram(basis), signal::transposed_product(basis, position))(1, 0) / dt;
}

/// A link that moves: rates by the record's position or, without one, by the time between two reversals.
void guess_motion(const WaveformData& data, const WaveformSettings& settings, const WaveformWindow& window,
                  WaveformStartGuess& guess) {
  const double unit = kWaveformRateTime * settings.sensor_stiffness;
  const double acceleration = data.level / moved_inertia(settings);
  const double lead = window.reversal, whole = window.samples * data.grid.interval;
  const bool seen = !data.position.empty();
  guess.spread[kStartPinionRate - kStartTwist] += unit * acceleration * (seen ? lead : whole);
  guess.step[kStartPinionRate - kStartTwist] = kStep * guess.spread[kStartPinionRate - kStartTwist];
  if (!seen) return;
  const double twist = data.level / settings.sensor_stiffness;
  guess.value[kStartPinionRate - kStartTwist] = window.side * unit * first_speed(data, window);
  const double load = guess.value[0] / settings.sensor_stiffness;
  guess.value[kStartZero - kStartTwist] =
      data.position[static_cast<std::size_t>(window.first)] - window.side * (load + twist);
  guess.spread[kStartZero - kStartTwist] = kGaps * twist;
  guess.step[kStartZero - kStartTwist] = kStep * twist;
}

}  // namespace

int waveform_start_count(const WaveformData& data, const WaveformSettings& settings) {
  const int all = kStartValues;
  if (settings.output == WaveformOutput::locked) return all - 2;
  return data.position.empty() ? all - 1 : all;
}

std::vector<WaveformStartGuess> waveform_starts(const WaveformData& data, const WaveformSettings& settings) {
  std::vector<WaveformStartGuess> all;
  for (const WaveformWindow& window : data.windows) {
    WaveformStartGuess guess;
    const double load = load_before(data, window);
    guess.value << load, load, 0, 0, 0, 0;
    for (int k = 0; k < kStartValues; ++k) guess.spread[k] = kSpread[k] * data.level;
    guess.spread[kStartZero - kStartTwist] = 1;
    guess.step.setConstant(kStep * data.level);
    if (settings.output != WaveformOutput::locked) guess_motion(data, settings, window, guess);
    all.push_back(guess);
  }
  return all;
}

}  // namespace backlash::diagnosis
