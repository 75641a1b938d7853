// SPDX-License-Identifier: BSD-3-Clause
// Bandwidth of a recorded motion, and the white noise above it.
#pragma once

#include <vector>

namespace backlash::signal {

/// Standard deviation of the white noise of a signal, in the unit of `values`: the smaller of two estimates.
/// One is the median of the periodogram (Hann window) in the upper three tenths of the frequencies, where
/// machines no longer move. The other is the rms of third differences without the largest tenth of them,
/// which jumps of a commanded torque would enlarge. Both estimate white noise alike; motion and jumps enlarge
/// one or the other. Coloured noise counts as white noise of its density at high frequencies. A position may
/// drift and travel. Throws InvalidParameter for fewer than 64 values.
double white_noise(const std::vector<double>& values);

/// Standard deviation of the noise of a position, as if white, from the largest density of its periodogram in
/// bands above a tenth of the sampling rate. Jitter of the stamps makes noise that is not white and is
/// strongest below the highest frequencies, so the upper three tenths alone would miss it. Throws as
/// white_noise.
double position_noise(const std::vector<double>& position);

/// Resolution of a quantised position, in its unit: the smallest change between successive samples if 99 % of
/// the small changes (up to ten steps) are multiples of it, else 0.
double resolution(const std::vector<double>& position);

/// Frequency [Hz] below which 99 % of the power of the acceleration lie. The acceleration is the second
/// difference of `position`, sampled every `interval` [s]; the power of position_noise, which grows with the
/// fourth power of the frequency, is subtracted, and frequencies from where it is half of the power are left
/// out. At most 0.4 / interval. Throws CannotIdentify if no motion exceeds the noise, InvalidParameter for
/// fewer than 64 values or an interval <= 0.
double motion_bandwidth(const std::vector<double>& position, double interval);

/// Frequency [Hz] below which 99.9 % of the power of a torque lie, its white_noise subtracted; at most the
/// frequency below which 99.9 % of the power of the acceleration lie. It shows a torque that is faster than a
/// slow, smooth motion, such as cogging. 0 if nothing exceeds the noise. Throws InvalidParameter as
/// motion_bandwidth.
double torque_bandwidth(const std::vector<double>& torque, const std::vector<double>& position,
                        double interval);

/// Standard deviation of white noise of standard deviation 1 after low_pass (zero_phase.h) with this
/// `interval` [s] and `cutoff` [Hz]. Throws as low_pass.
double noise_after_low_pass(double interval, double cutoff);

}  // namespace backlash::signal
