// SPDX-License-Identifier: BSD-3-Clause
// Random numbers that are the same for a seed with every compiler and library.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>

namespace machines {

class Random {
 public:
  /// A stream of its own for each seed and purpose.
  Random(std::uint64_t seed, const std::string& purpose) {
    std::uint64_t hash = 1469598103934665603u ^ seed * 0x9E3779B97F4A7C15u;  // FNV-1a
    for (unsigned char c : purpose) hash = (hash ^ c) * 1099511628211u;
    engine_.seed(hash);
  }

  double uniform(double from, double to) {
    return from + (to - from) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  int whole(int from, int to) { return static_cast<int>(std::floor(uniform(from, to + 1.0))); }
  bool chance(double probability) { return uniform(0, 1) < probability; }
  double sign() { return chance(0.5) ? 1 : -1; }
  double phase() { return uniform(0, 2 * kPi); }
  double normal() {  // Box and Muller; 1 - u is never 0
    return std::sqrt(-2 * std::log(1 - uniform(0, 1))) * std::cos(phase());
  }

  static constexpr double kPi = 3.141592653589793;

 private:
  std::mt19937_64 engine_;
};

}  // namespace machines
