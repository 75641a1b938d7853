// SPDX-License-Identifier: BSD-3-Clause
// What pairs of teeth do at rest, written apart from the code of the package.
#pragma once

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/model/tooth_pairs.h"

namespace backlash::test {

struct PairsAtRest {
  double contact_ratio, transition;  // -, base pitches
  double stiffness;                  // N/m, mean of the mesh
  int pinion_teeth, gear_teeth;
};

/// One pair of the Lin and Parker law after Yumrukcal (2013), Eqs. 2.30 and 2.31, over the mean of the mesh,
/// with a cubic at either end; u in base pitches since the first touch.
inline double pair_weight(const PairsAtRest& pairs, double u) {
  const auto ramp = [&](double x) {
    const double t = std::clamp(x / pairs.transition + 0.5, 0.0, 1.0);
    return t * t * (3 - 2 * t);
  };
  const double t = std::clamp(u / pairs.contact_ratio, 0.0, 1.0);
  return ramp(u) * (1 - ramp(u - pairs.contact_ratio)) * (-1.8 * t * t + 1.8 * t + 0.55) /
         (0.85 * pairs.contact_ratio);
}

/// Depth [m] at which the forward flanks at `phase` carry the force [N], by bisection. Errors of single teeth
/// do not count.
inline double depth_at_rest(const PairsAtRest& pairs, const model::ToothErrors& e, double phase,
                            double force) {
  const auto runout = [](const model::PitchErrors& errors, int pair, int teeth) {
    return errors.runout * std::sin(2 * M_PI * pair / teeth + errors.phase);
  };
  double low = -1e-3, high = 1e-3;
  for (int i = 0; i < 60; ++i) {
    const double d = 0.5 * (low + high);
    double sum = 0;
    for (int pair = int(std::floor(phase)) - 3; pair <= int(std::floor(phase)) + 1; ++pair) {
      const double u = phase - pair, t = u / pairs.contact_ratio;
      const double error = e.slope * (t - 0.5) + e.crown * std::pow(2 * t - 1, 2) +
                           runout(e.pinion, pair, pairs.pinion_teeth) +
                           runout(e.gear, pair, pairs.gear_teeth);
      sum += pair_weight(pairs, u) * pairs.stiffness * std::max(0.0, d - error);
    }
    (sum > force ? high : low) = d;
  }
  return 0.5 * (low + high);
}

}  // namespace backlash::test
