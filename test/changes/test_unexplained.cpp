// SPDX-License-Identifier: BSD-3-Clause
// Squares that the test draws: of a healthy machine chi-square by its definition, then louder by a factor.
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "changes/unexplained.h"

namespace backlash::changes {
namespace {

constexpr double kRate = 50, kDuration = 200;  // Hz, s

/// `times(t)`: mean square over that of a healthy machine.
std::optional<LoudStretch> stretch_of(unsigned seed, const std::function<double(double)>& louder) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> times, squares;
  for (int k = 0; k < int(kDuration * kRate); ++k) {
    const double x = normal(random);
    times.push_back(k / kRate);
    squares.push_back(louder(times.back()) * x * x);
  }
  return loud_stretch(times, squares, {});
}

TEST(LoudStretch, HealthyNoiseHasNone) {
  // 600 squares in the shortest stretch: a mean of 4 is 50 standard deviations away.
  for (unsigned seed = 1; seed <= 20; ++seed) EXPECT_FALSE(stretch_of(seed, [](double) { return 1; }));
}

TEST(LoudStretch, LessThanTheFactorIsNone) {
  // 3 +- 0.07
  EXPECT_FALSE(stretch_of(1, [](double t) { return t < 100 ? 1 : 3; }));
}

TEST(LoudStretch, BeginsAndEndsWhereItIsLoud) {
  const auto found = stretch_of(2, [](double t) { return t > 80 && t < 130 ? 9 : 1; });
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->from, 80, 4);  // a window
  EXPECT_NEAR(found->to, 130, 4);
  EXPECT_NEAR(found->times, 9, 1);  // 2500 squares: 0.25 standard deviations, and a window at either end
  EXPECT_NEAR(found->excess / (8 * 50 * kRate), 1, 0.15);
  EXPECT_FALSE(found->from_beginning);
  EXPECT_FALSE(found->to_end);
}

TEST(LoudStretch, OfAllOfTheRecordIsFromItsBeginning) {
  const auto found = stretch_of(3, [](double) { return 9; });
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->from_beginning);
  EXPECT_TRUE(found->to_end);
}

TEST(LoudStretch, IsFoundThoughWhatIsFittedSpreadsIt) {
  // Least squares of what may drift leave a fiftieth of a loud end before it.
  const auto found = stretch_of(4, [](double t) { return t < 120 ? 20 : 1000; });
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->from, 120, 4);
  EXPECT_FALSE(found->from_beginning);
}

TEST(LoudStretch, OnePushIsNone) {
  EXPECT_FALSE(stretch_of(5, [](double t) { return t > 90 && t < 93 ? 200 : 1; }));
}

/// A record of 300 s louder by `louder(t)`, its motion a sine whose size goes by `moves(t)`.
std::optional<LoudStretch> louder_of(
    unsigned seed, const std::function<double(double)>& louder,
    const std::function<double(double)>& moves = [](double) { return 1; }) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> times, squares;
  for (int k = 0; k < int(300 * kRate); ++k) {
    const double x = normal(random);
    times.push_back(k / kRate);
    squares.push_back(louder(times.back()) * x * x);
  }
  Eigen::MatrixXd motion(static_cast<Eigen::Index>(times.size()), 1);
  for (Eigen::Index r = 0; r < motion.rows(); ++r) {
    const double t = times[static_cast<std::size_t>(r)];
    motion(r, 0) = moves(t) * std::fabs(std::sin(1.7 * t));
  }
  return louder_stretch(times, squares, motion, {});
}

TEST(LouderStretch, HealthyNoiseHasNone) {
  // 3200 squares in the shortest stretch: a mean of 1.5 is 20 standard deviations away.
  for (unsigned seed = 1; seed <= 20; ++seed) EXPECT_FALSE(louder_of(seed, [](double) { return 1; }));
}

TEST(LouderStretch, IsFoundFarBelowALoudOne) {
  const auto found = louder_of(2, [](double t) { return t > 150 && t < 260 ? 2 : 1; });
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->from, 150, 4);  // a window
  EXPECT_NEAR(found->to, 260, 4);
  EXPECT_NEAR(found->times, 2, 0.1);  // 5500 squares: 0.04 standard deviations, and a window at either end
}

TEST(LouderStretch, AnotherTaskIsNone) {
  EXPECT_FALSE(louder_of(
      2, [](double t) { return t > 150 ? 2 : 1; }, [](double t) { return t > 150 ? 1.3 : 1; }));
}

TEST(LouderStretch, AllOfTheRecordIsNone) {
  EXPECT_FALSE(louder_of(3, [](double) { return 3; }));
}

TEST(LouderStretch, TwoPushesAreNone) {
  EXPECT_FALSE(louder_of(4, [](double t) { return (t > 101 && t < 103) || (t > 141 && t < 143) ? 40 : 1; }));
}

}  // namespace
}  // namespace backlash::changes
