// SPDX-License-Identifier: BSD-3-Clause
// One sine of torque at a time: where they are in a record, and the response at each (Yumrukcal 2013, Section
// 3.3: 0.25 to 100 Hz in steps of 0.25 Hz, ten cycles each).
#pragma once

#include <cstddef>
#include <vector>

#include "backlash_diagnosis/identification/procedures/frequency_response.h"

namespace backlash::identification {

constexpr double kHighestFrequency = 0.25;  // choice: of the sampling rate, that a response is given at

/// Whole cycles of one sine, from a rising passage of its mean to another; in samples, may be fractions.
struct SineRun {
  double begin = 0, end = 0;
  std::size_t cycles = 0;
  double frequency() const { return double(cycles) / (end - begin); }  // cycles per sample
};

struct SineRuns {
  std::vector<SineRun> runs;
  double share = 0;  // of the time between first and last passage, that lies in a run or a step between two
};

/// Runs of at least four cycles (at most 200, longer ones are cut) whose passages keep to an even step within
/// five deviations of their own jitter (0.1 to 2 % of a cycle), with half waves of equal height and mean
/// within 20 %, of which a sine explains 90 % of the power. So a frequency that steps by a fraction of a
/// percent may share a run with its neighbour, and a sweep that is slow enough consists of runs. Needs four
/// samples a cycle. White noise may be up to some 10 % of the largest amplitude; sines smaller than a tenth
/// of the largest, or than four deviations of the noise, are not seen.
SineRuns find_sine_runs(const std::vector<double>& torque);

/// Least squares of offset, slope, curvature, cosine and sine over the run without its first fifth (at
/// least one cycle: transient) and, from eight cycles on, without the last, which may belong to the next
/// sine; no window, no whole number of samples needed. Coherence: power at the line over the power of the
/// speed without offset, slope and curvature. Standard error from the scatter of the cycles; so it holds
/// noise of both channels, and what is left of the transient. No correction for sampling.
ResponsePoint sine_response(const std::vector<double>& torque, const std::vector<double>& speed,
                            const SineRun& run);

}  // namespace backlash::identification
