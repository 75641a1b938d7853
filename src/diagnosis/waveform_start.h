// SPDX-License-Identifier: BSD-3-Clause
// How the windows of a fit start, as far as the record and the declared machine tell it beforehand.
#pragma once

#include <vector>

#include "waveform_fit.h"

namespace backlash::diagnosis {

/// One guess per window of the data.
std::vector<WaveformStartGuess> waveform_starts(const WaveformData& data, const WaveformSettings& settings);

/// How many of the start values are fitted.
int waveform_start_count(const WaveformData& data, const WaveformSettings& settings);

}  // namespace backlash::diagnosis
