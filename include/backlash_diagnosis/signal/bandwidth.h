// SPDX-License-Identifier: BSD-3-Clause
// Bandwidth of a recorded motion, and the white noise above it.
#pragma once

#include <vector>

namespace backlash::signal {

/// Standard deviation of the white noise of a signal: the smaller of two estimates, which noise raises
/// equally and motion differently. From the median of its periodogram (Hann window) in the upper three tenths
/// of the frequencies, where machines no longer move; from third differences without the largest tenth, which
/// jumps of a commanded torque do not reach. Coloured noise counts as white with the density that it has
/// there. `values` of a position may drift and travel. Throws InvalidParameter for fewer than 64 values.
double white_noise(const std::vector<double>& values);

/// The same of a position, but with the largest density in bands above a tenth of the sampling rate: stamps
/// that jitter make noise that is not white, the worst of it below the highest frequencies.
double position_noise(const std::vector<double>& position);

/// Step of a position of finite resolution: the smallest change, where all small changes are multiples of it;
/// 0 where they are not.
double resolution(const std::vector<double>& position);

/// Frequency [Hz] below which 99 % of the power of the acceleration lie, the second difference of `position`,
/// after position_noise (with the fourth power of frequency) is taken off and not beyond
/// where that noise is half of the power. At most 0.4 / interval. Throws CannotIdentify where nothing stands
/// out of the noise, InvalidParameter for fewer than 64 values or an interval <= 0.
double motion_bandwidth(const std::vector<double>& position, double interval);

/// Frequency [Hz] below which 99.9 % of the power of a torque lie, beyond its white_noise, and not beyond
/// that of the acceleration of `position`; 0 where nothing stands out of the noise: a slow and smooth motion
/// may hide that the torque follows something fast, such as cogging. Throws as motion_bandwidth for sizes and
/// intervals.
double torque_bandwidth(const std::vector<double>& torque, const std::vector<double>& position,
                        double interval);

/// Standard deviation that low_pass (zero_phase.h) leaves of white noise of standard deviation 1.
double noise_after_low_pass(double interval, double cutoff);

}  // namespace backlash::signal
