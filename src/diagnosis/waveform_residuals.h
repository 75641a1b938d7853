// SPDX-License-Identifier: BSD-3-Clause
// What a gear train with a torque sensor leaves of the windows of its record, whitened: of the torque, then
// of the position where that is recorded.
#pragma once

#include "waveform_priors.h"
#include "waveform_start.h"

namespace backlash::diagnosis {

enum WaveformChannel { kTorqueChannel, kPositionChannel, kWaveformChannels };

class WaveformResiduals : public fit::Windows {
 public:
  /// `data` must outlive it. `chosen`: windows of it.
  WaveformResiduals(const WaveformData& data, const WaveformSettings& settings, WaveformPriors priors,
                    std::vector<std::size_t> chosen);

  /// How far it looks, in cycles beyond a reversal, what counts as noise [N m, rad], and whether half of the
  /// steps will do.
  double rings = 3, noise[kWaveformChannels] = {1, 1};
  bool coarse = false;

  int count() const override { return int(chosen_.size()); }
  const fit::Priors& shared() const override { return priors_.shared; }
  const fit::Priors& own() const override { return own_; }
  Eigen::MatrixXd residuals(int w, const Eigen::MatrixXd& shared, const Eigen::MatrixXd& own) const override;

  const WaveformPriors& priors() const { return priors_; }
  int channels() const { return data_.position.empty() ? 1 : 2; }
  const std::vector<std::size_t>& chosen() const { return chosen_; }
  std::size_t length(int w) const;

 private:
  const WaveformData& data_;
  WaveformPriors priors_;
  std::vector<std::size_t> chosen_;
  std::vector<WaveformStartGuess> starts_;  // of each window of the data
  fit::Priors own_;
  WaveformGrid grid_;
  double ring_, unseen_;  // s; of the torque after the start: what a late sensor shows there was before it
};

}  // namespace backlash::diagnosis
