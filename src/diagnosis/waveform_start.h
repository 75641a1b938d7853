// SPDX-License-Identifier: BSD-3-Clause
// How the windows of a fit start, as far as the record and the declared machine show it beforehand.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "waveform_windows.h"

namespace backlash::diagnosis {

using WaveformStart = Eigen::Matrix<double, kStartValues, 1>;
struct WaveformStartGuess {
  WaveformStart value = WaveformStart::Zero(), spread = WaveformStart::Zero();  ///< spread 0: it is known
};

/// One per window of the data.
std::vector<WaveformStartGuess> waveform_starts(const WaveformData& data, const WaveformSettings& settings);

}  // namespace backlash::diagnosis
