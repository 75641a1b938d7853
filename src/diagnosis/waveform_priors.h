// SPDX-License-Identifier: BSD-3-Clause
// What the declared machine says before a record is fitted: scales of length, time and position, and how well
// each value is known.
#pragma once

#include <vector>

#include "waveform_fit.h"

namespace backlash::diagnosis {

/// m along the line of action, by which `level` [N m] twists the sensor.
double waveform_twist(const WaveformSettings& settings, double level);

/// s, cycle of the motor against the pinion.
double waveform_ring(const WaveformSettings& settings);

/// For samples at this interval [s], under a torque of `level` [N m].
WaveformGrid waveform_grid(const WaveformSettings& settings, double interval, double level);

/// Half of the range, but for rare values; 1 without values.
double waveform_swing(const std::vector<double>& values);

/// rad, the same of the position. Of a free link, whose place drifts, within the windows.
double waveform_position_swing(const WaveformData& data);

WaveformPriors waveform_priors(const WaveformSettings& settings, const WaveformData& data);

/// Least standard error of the logarithm of the gap from torque alone: by the symmetry of waveform.h the
/// torque says nothing of the factor c, so that the priors alone hold it. Theory.
double waveform_symmetry_error(const WaveformPriors& priors, double common);

}  // namespace backlash::diagnosis
