// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/studies/minimise.h"

namespace backlash::studies {
namespace {

using Point = std::vector<double>;

const Point kOptimum = {0.2, 0.7, 0.55, 0.05};

/// A bowl with ripples (Rastrigin): one global minimum, value 0 at kOptimum, and about 3^4 local ones, 0.3
/// apart: the next best has a value of about 0.1.
double rippled(const Point& x) {
  double value = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double d = x[i] - kOptimum[i];
    value += d * d + 0.1 * (1 - std::cos(6 * M_PI * d));
  }
  return value;
}

MinimiseSettings settings(std::uint64_t seed, unsigned threads) {
  MinimiseSettings s;
  s.seed = seed;
  s.threads = threads;
  s.population = 30;
  s.budget = 6000;
  return s;
}

TEST(Minimise, FindsTheGlobalMinimumAmongLocalOnes) {
  for (std::uint64_t seed : {1, 2, 3}) {
    const MinimiseResult found = minimise(rippled, 4, settings(seed, 1));
    // Far below 0.1, the value in the next local minimum; 6000 evaluations give some 1e-9.
    EXPECT_LT(found.value, 1e-4) << seed;
    EXPECT_EQ(found.value, rippled(found.x));
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(found.x[i], kOptimum[i], 0.01) << seed;  // sqrt(1e-4)
    EXPECT_LE(found.evaluations, 6000);
    EXPECT_GT(found.evaluations, 6000 - 30);
    for (std::size_t i = 1; i < found.history.size(); ++i)
      EXPECT_LE(found.history[i].value, found.history[i - 1].value);
    EXPECT_EQ(found.history.back().value, found.value);
  }
}

TEST(Minimise, FindsAMinimumAtTheWallAndStaysInside) {
  const auto slope = [](const Point& x) {
    for (const double u : x) {
      EXPECT_GE(u, 0);
      EXPECT_LE(u, 1);
    }
    return x[0] - x[1];
  };
  const MinimiseResult found = minimise(slope, 2, settings(1, 1));
  EXPECT_NEAR(found.value, -1, 1e-6);  // half way to the wall each time
}

TEST(Minimise, DependsOnTheSeedNotOnTheThreads) {
  const MinimiseResult one = minimise(rippled, 4, settings(5, 1));
  for (unsigned threads : {2, 7}) {
    const MinimiseResult many = minimise(rippled, 4, settings(5, threads));
    EXPECT_EQ(many.x, one.x);
    EXPECT_EQ(many.evaluations, one.evaluations);
  }
  EXPECT_NE(minimise(rippled, 4, settings(6, 1)).x, one.x);
}

TEST(Minimise, StopsAtItsGoal) {
  MinimiseSettings s = settings(1, 1);
  s.goal = 0.01;
  const MinimiseResult found = minimise(rippled, 4, s);
  EXPECT_LE(found.value, 0.01);
  EXPECT_LT(found.evaluations, 3000);
}

TEST(Minimise, ANaNIsNeverTheBest) {
  const auto holed = [](const Point& x) { return x[0] < 0.5 ? std::nan("") : x[0]; };
  EXPECT_NEAR(minimise(holed, 1, settings(1, 2)).value, 0.5, 1e-3);
}

TEST(Minimise, StopsWhenProgressSaysSoAndPassesOnErrors) {
  std::atomic<int> calls{0};
  EXPECT_THROW(
      minimise(rippled, 4, settings(1, 2), [&](double, const std::string&) { return ++calls < 100; }),
      Cancelled);
  EXPECT_EQ(calls, 100);
  EXPECT_THROW(minimise([](const Point&) -> double { throw BadData("x", "y"); }, 1, settings(1, 2)), BadData);
}

TEST(Minimise, RefusesNonsense) {
  MinimiseSettings s = settings(1, 1);
  EXPECT_THROW(minimise(rippled, 0, s), InvalidParameter);
  s.population = 3;
  EXPECT_THROW(minimise(rippled, 4, s), InvalidParameter);
  s = settings(1, 1);
  s.budget = 29;
  EXPECT_THROW(minimise(rippled, 4, s), InvalidParameter);
}

}  // namespace
}  // namespace backlash::studies
