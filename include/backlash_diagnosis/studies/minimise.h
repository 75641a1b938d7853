// SPDX-License-Identifier: BSD-3-Clause
// Global minimum of a function that has no derivative, is rough and is expensive: differential evolution.
//
//   start:      `population` points of a Latin hypercube in [0, 1)^n
//   generation: for each member x   v = x + F (b - x) + F (r1 - r2),   b one of the best 15 %, r1, r2 any
//   others
//               trial = coordinate by coordinate v (probability 0.9, at least one) or x; it replaces x where
//               not worse F uniform in [0.4, 0.9], one per trial; coordinates that leave the cube are set
//               half way to its wall
// After Storn and Price (1997), with the mutation "current to p-best" of Zhang and Sanderson (2009). All
// random numbers of a generation are drawn before it is evaluated, so that the result depends on the seed
// alone, not on the number of threads.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "backlash_diagnosis/base/progress.h"

namespace backlash::studies {

struct MinimiseSettings {
  std::uint64_t seed = 1;
  int population = 40;   // >= 4
  int budget = 2000;     // evaluations at most, >= population
  double goal = -1e300;  // stop after the generation that reaches it
  unsigned threads = 0;  // 0: all processors
};

struct MinimiseResult {
  std::vector<double> x;
  double value = 0;
  long evaluations = 0;
  struct Step {
    long evaluations;
    double value;
  };
  std::vector<Step> history;  // best value after each generation
};

/// `function` takes a point of [0, 1]^n and may run in several threads at once; NaN counts as +infinity.
/// Throws InvalidParameter, Cancelled, and what the function throws.
MinimiseResult minimise(const std::function<double(const std::vector<double>&)>& function,
                        std::size_t dimensions, const MinimiseSettings& settings,
                        const Progress& progress = nullptr);

}  // namespace backlash::studies
