// SPDX-License-Identifier: BSD-3-Clause
// What a signal itself shows of the conditions it was taken under: period, amplitude, saturation.
#pragma once

#include <optional>
#include <vector>

namespace backlash::diagnosis {

/// Repetition time of a signal [s], from the first maximum of its autocorrelation that is nearly as high as
/// the highest. Rounded to a whole number of samples (of steps of n/65536 samples for a period of n > 65536).
/// Nothing for a constant or aperiodic signal (correlation below 0.5) or one that dies out, for values that
/// are not finite, or for a record shorter than two periods. `time` may jitter; gaps longer than a sample are
/// bridged linearly.
std::optional<double> detect_period(const std::vector<double>& time, const std::vector<double>& signal);

/// Median of |x|; the size of a signal that a few peaks or outliers cannot change.
double signal_level(std::vector<double> signal);

/// True when the extreme values repeat in runs as a saturated sensor's do: at least 3 samples in a row at
/// exactly the largest (or smallest) value, making up more than 0.5 % of the record, where a third of the
/// runs or more begin at full speed. A signal that comes to rest at its extreme slows down before.
bool looks_saturated(const std::vector<double>& signal);

}  // namespace backlash::diagnosis
