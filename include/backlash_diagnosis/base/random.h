// SPDX-License-Identifier: BSD-3-Clause
// Random numbers that are the same for a seed on every platform: Boost defines its distributions, the
// standard library leaves them to each implementation.
#pragma once

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <boost/random/seed_seq.hpp>
#include <boost/random/uniform_01.hpp>
#include <cstddef>
#include <cstdint>

namespace backlash {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// One of many streams of a seed: numbers of different streams are independent of each other.
  Random(std::uint64_t seed, std::uint32_t stream) {
    boost::random::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                                     stream};
    engine_.seed(sequence);
  }

  /// In [0, 1).
  double uniform() { return boost::random::uniform_01<double>()(engine_); }

  /// In [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Mean 0, standard deviation 1.
  double normal() { return boost::random::normal_distribution<double>()(engine_); }

  /// 0 ... n - 1, all alike, for n far below 2^53.
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(uniform() * static_cast<double>(n)); }

  /// 64 random bits, as a seed.
  std::uint64_t bits() { return engine_(); }

 private:
  boost::random::mt19937_64 engine_;
};

}  // namespace backlash
