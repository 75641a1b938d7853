// SPDX-License-Identifier: BSD-3-Clause
// What code for one rig and for several (lanes.h) needs: for either, and for one.
#pragma once

#include <cmath>

namespace backlash::simulation {

#define BACKLASH_LANES inline __attribute__((always_inline))

/// How many rigs a Real holds.
template <typename Real>
constexpr int kLanesOf = static_cast<int>(sizeof(Real) / sizeof(double));

template <typename Real>
BACKLASH_LANES Real larger(const Real& a, const Real& b) {
  return a > b ? a : b;
}

template <typename Real>
BACKLASH_LANES Real smaller(const Real& a, const Real& b) {
  return a < b ? a : b;
}

template <typename Real>
BACKLASH_LANES Real magnitude(const Real& a) {
  return a < 0 ? -a : a;
}

BACKLASH_LANES double root(double a) {
  return std::sqrt(a);
}

BACKLASH_LANES double any_power(double a, double exponent) {
  return std::pow(a, exponent);
}

BACKLASH_LANES double lane(const double& a, int) {
  return a;
}

BACKLASH_LANES void set_lane(double& a, int, double value) {
  a = value;
}

}  // namespace backlash::simulation
