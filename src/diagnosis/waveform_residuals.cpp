// SPDX-License-Identifier: BSD-3-Clause
#include "waveform_residuals.h"

#include <algorithm>
#include <utility>

namespace backlash::diagnosis {
namespace {

constexpr double kLatest = 3;  // spreads, of the delay of the sensor: theory

}  // namespace

WaveformResiduals::WaveformResiduals(const WaveformData& data, const WaveformSettings& settings,
                                     WaveformPriors priors, std::vector<std::size_t> chosen)
    : data_(data),
      priors_(std::move(priors)),
      chosen_(std::move(chosen)),
      starts_(waveform_starts(data, settings)),
      own_(kStartValues),
      grid_(waveform_grid(settings, data.level)),
      ring_(waveform_ring(settings)),
      unseen_(std::min(settings.sensor_delay + kLatest * settings.spread.sensor_delay, ring_ / 2)) {
  for (int k = 0; k < kStartValues; ++k) {
    const bool free = std::any_of(starts_.begin(), starts_.end(),
                                  [k](const WaveformStartGuess& guess) { return guess.spread[k] > 0; });
    own_[std::size_t(k)] = {"start", 0, free ? 1.0 : 0.0, false};
  }
}

std::size_t WaveformResiduals::length(int w) const {
  return waveform_length(data_.windows[chosen_[std::size_t(w)]], rings, ring_);
}

Eigen::MatrixXd WaveformResiduals::residuals(int w, const Eigen::MatrixXd& shared,
                                             const Eigen::MatrixXd& own) const {
  const WaveformWindow& window = data_.windows[chosen_[std::size_t(w)]];
  const WaveformStartGuess& guess = starts_[chosen_[std::size_t(w)]];
  const std::size_t samples = length(w);
  WaveformGrid grid = grid_;
  if (coarse) grid.step *= 2;
  Eigen::MatrixXd left(Eigen::Index(samples) * channels(), shared.cols());
  const bool lacking = shared.middleRows(kStribeck, kGlobalValues - kStribeck).cwiseAbs().maxCoeff() > 0;
  WaveformSets sets;
  WaveformMotion motion;
  for (Eigen::Index from = 0; from < shared.cols(); from += kWaveformSets) {
    for (Eigen::Index i = 0; i < kWaveformSets; ++i) {
      const Eigen::Index column = std::min(from + i, shared.cols() - 1);
      for (int k = 0; k < kGlobalValues; ++k)
        sets[std::size_t(k)][std::size_t(i)] = priors_.value(k, shared.col(column));
      for (int k = 0; k < kStartValues; ++k)
        sets[std::size_t(kGlobalValues + k)][std::size_t(i)] =
            guess.value[k] + guess.spread[k] * own(k, column);
    }
    move_waveform(window, grid, samples, lacking, sets, motion);
    for (Eigen::Index i = 0; i < kWaveformSets && from + i < shared.cols(); ++i)
      for (std::size_t s = 0; s < samples; ++s) {
        const auto row = Eigen::Index(s);
        const double torque = data_.torque[window.first + s] - motion.torque[s][std::size_t(i)];
        left(row, from + i) = window.at[s] < unseen_ ? 0 : torque / noise[kTorqueChannel];
        if (channels() > 1)
          left(Eigen::Index(samples) + row, from + i) =
              (data_.position[window.first + s] - motion.position[s][std::size_t(i)]) /
              noise[kPositionChannel];
      }
  }
  return left;
}

}  // namespace backlash::diagnosis
