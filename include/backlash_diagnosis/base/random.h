// SPDX-License-Identifier: BSD-3-Clause
// Random numbers that are the same for a seed on every platform: Boost defines its distributions, the
// standard library leaves them to each implementation.
#pragma once

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <boost/random/uniform_01.hpp>
#include <cstdint>

namespace backlash {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  double uniform() { return boost::random::uniform_01<double>()(engine_); }  ///< in [0, 1)
  double normal() {
    return boost::random::normal_distribution<double>()(engine_);
  }  ///< mean 0, standard deviation 1

 private:
  boost::random::mt19937_64 engine_;
};

}  // namespace backlash
