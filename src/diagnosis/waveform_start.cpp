// SPDX-License-Identifier: BSD-3-Clause
#include "waveform_start.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::diagnosis {
namespace {

// All choices, tried on simulated machines.
constexpr double kSpread[] = {0.4, 0.4, 0.2, 0.2, 0.4};  // of the level
constexpr double kGaps = 6;                 // twists of the sensor, how far off the position's zero may be
constexpr std::size_t kFewestForSpeed = 4;  // samples

std::size_t samples_before(const WaveformWindow& w) {
  return static_cast<std::size_t>(std::lower_bound(w.at.begin(), w.at.end(), w.reversal) - w.at.begin());
}

/// Of the sensor, N m towards the flank that is loaded before the reversal: their mean where that does not
/// change, else the first one.
double load_before(const WaveformData& data, const WaveformWindow& window) {
  const std::size_t count = data.square ? samples_before(window) : 1;
  double mean = 0;
  for (std::size_t i = 0; i < count; ++i) mean += data.torque[window.first + i] / static_cast<double>(count);
  return std::max(0.0, window.side * mean);
}

double moved_inertia(const WaveformSettings& s) {
  return s.motor_inertia + s.pinion_inertia + (std::isnan(s.gear_inertia) ? 0 : s.gear_inertia) +
         s.link_inertia;
}

/// Speed at the first sample, rad/s, by a parabola through the samples before the reversal.
double first_speed(const WaveformData& data, const WaveformWindow& window) {
  const std::size_t count = std::clamp(samples_before(window), kFewestForSpeed, window.at.size());
  Eigen::MatrixXd basis(count, 3);
  Eigen::VectorXd position(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double t = window.at[i] / data.interval;
    basis.row(row) << 1, t, t * t;
    position[row] = data.position[window.first + i];
  }
  return signal::solve_symmetric(signal::gram(basis), signal::transposed_product(basis, position))(1, 0) /
         data.interval;
}

/// A link that moves: rates by the record's position or, without one, by the time between two reversals.
void guess_motion(const WaveformData& data, const WaveformSettings& settings, const WaveformWindow& window,
                  WaveformStartGuess& guess) {
  const double unit = kWaveformRateTime * settings.sensor_stiffness;
  const double acceleration = data.level / moved_inertia(settings);
  const bool seen = !data.position.empty();
  guess.spread[kStartGearRate - kStartTwist] = kSpread[kStartGearRate - kStartTwist] * data.level;
  guess.spread[kStartPinionRate - kStartTwist] +=
      unit * acceleration * (seen ? window.reversal : window.at.back());
  if (!seen) return;
  const double twist = data.level / settings.sensor_stiffness;
  guess.value[kStartPinionRate - kStartTwist] = window.side * unit * first_speed(data, window);
  const double load = guess.value[0] / settings.sensor_stiffness;
  guess.value[kStartZero - kStartTwist] = data.position[window.first] - window.side * (load + twist);
  guess.spread[kStartZero - kStartTwist] = kGaps * twist;
}

}  // namespace

std::vector<WaveformStartGuess> waveform_starts(const WaveformData& data, const WaveformSettings& settings) {
  std::vector<WaveformStartGuess> all;
  for (const WaveformWindow& window : data.windows) {
    WaveformStartGuess guess;
    guess.value[kStartTwist - kStartTwist] = guess.value[kStartFlank - kStartTwist] =
        load_before(data, window);
    for (const int k : {kStartTwist, kStartFlank, kStartTwistRate, kStartPinionRate})
      guess.spread[k - kStartTwist] = kSpread[k - kStartTwist] * data.level;
    guess.spread[kStartSwitch - kStartTwist] = data.square ? window.unsure : 0;
    if (settings.output != WaveformOutput::locked) guess_motion(data, settings, window, guess);
    all.push_back(guess);
  }
  return all;
}

}  // namespace backlash::diagnosis
