// SPDX-License-Identifier: BSD-3-Clause
// Periodic signals in closed form, sampled with noise and jitter.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/random.h"

namespace backlash::test {

using Wave = std::function<double(double phase)>;  // phase in periods

inline const std::vector<std::pair<std::string, Wave>> kWaves = {
    {"sine", [](double p) { return std::sin(2 * M_PI * p); }},
    {"square", [](double p) { return p - std::floor(p) < 0.5 ? 1.0 : -1.0; }},
    {"triangle", [](double p) { return 4 * std::fabs(p - std::floor(p) - 0.5) - 1; }},
    {"sawtooth", [](double p) { return 2 * (p - std::floor(p)) - 1; }},
    {"pulses", [](double p) { return p - std::floor(p) < 0.1 ? 1.0 : 0.0; }},
    // Lines at 2, 3 and 5 times the common frequency: repeats once per period, and nearly so earlier.
    {"multi-sine",
     [](double p) {
       return std::sin(4 * M_PI * p) + std::sin(6 * M_PI * p + 1) + 0.5 * std::sin(10 * M_PI * p);
     }},
    // A square wave whose steps ring ten times faster.
    {"ringing",
     [](double p) {
       const double half = 2 * (p - std::floor(p)), s = half < 1 ? half : half - 1, sign = half < 1 ? 1 : -1;
       return sign * (1 - 2 * std::exp(-4 * s) * std::cos(20 * M_PI * s));
     }},
};

struct Signal {
  std::vector<double> time, value;
};

/// `noise`: standard deviation; `jitter`: of the stamps, in samples.
inline Signal sample(const Wave& wave, double periods, double per_period, double noise = 0, double jitter = 0,
                     double start = 0) {
  Random random(7);
  Signal signal;
  const auto count = static_cast<int>(std::lround(periods * per_period));
  for (int i = 0; i < count; ++i) {
    const double t = (i + std::max(-0.45, std::min(0.45, jitter * random.normal()))) / per_period;
    signal.time.push_back(start + t);
    signal.value.push_back(wave(t + 0.3 / per_period) + noise * random.normal());
  }
  return signal;
}

}  // namespace backlash::test
