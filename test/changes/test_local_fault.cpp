// SPDX-License-Identifier: BSD-3-Clause
// Places of faults in white noise of 1 along a sine that the test makes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "changes/local_fault.h"

namespace backlash::changes {
namespace {

constexpr double kRate = 50, kDuration = 240, kOnset = 120;  // Hz, s
constexpr double kSlow = 0.17, kFast = 0.29;                 // Hz
constexpr double kPlace = 0.4, kWidth = 0.06;                // rad
constexpr double kNone = 60;  // beyond 1e-10 of chance for a place, of some 1e5 places and onsets

struct Made {
  SampledMotion motion;
  Eigen::VectorXd left;
};

double bump(double q, double place) {
  const double x = (q - place) / kWidth;
  return std::exp(-0.5 * x * x);
}

Made made(const std::function<double(const Moment&)>& added) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Made out;
  out.motion.sampling.interval = out.motion.row_interval = 1 / kRate;
  out.motion.sampling.cutoff = 12;
  const auto n = static_cast<std::size_t>(kDuration * kRate);
  out.left.resize(static_cast<Eigen::Index>(n));
  for (std::size_t k = 0; k < n; ++k) {
    Moment m{};
    m.time = double(k) / kRate;
    const double a = 2 * M_PI * kSlow * m.time, b = 2 * M_PI * kFast * m.time;
    m.position = 0.9 * std::sin(a) + 0.5 * std::sin(b);
    m.direction = 0.9 * kSlow * std::cos(a) + 0.5 * kFast * std::cos(b) > 0 ? 1 : -1;
    out.motion.moments.push_back(m);
    out.motion.rows.push_back(k);
    out.left[static_cast<Eigen::Index>(k)] = added(m) + normal(random);
  }
  return out;
}

double repeated(const Made& m) {
  return repeated_gain(m.motion, local_fault(ChangeChannel::torque, kPlace, kWidth), m.left, kOnset,
                       kDuration);
}

double fault(const Moment& m) {
  return m.time < kOnset ? 0 : 2 * bump(m.position, kPlace);
}

TEST(LocalFault, IsSeenWhereItIs) {
  const Made m = made(fault);
  const auto places = FaultScreen(m.motion).likeliest(m.left, 1, 8, kNone);
  // Two of each width, of which the second may be its flank.
  EXPECT_TRUE(std::any_of(places.begin(), places.end(), [](const ChangeEffect& e) {
    return std::fabs(e.shape - kPlace) < e.width / 2 && e.width > kWidth / 2 && e.width < 2 * kWidth;
  }));
}

TEST(LocalFault, IsNotSeenInNoise) {
  const Made m = made([](const Moment&) { return 0; });
  EXPECT_TRUE(FaultScreen(m.motion).likeliest(m.left, 1, 8, kNone).empty());
  EXPECT_LT(repeated(m), 30);  // chi-square of two degrees: 3e-7
}

TEST(LocalFault, IsShownByManyPasses) {
  EXPECT_GT(repeated(made(fault)), 100);
}

TEST(LocalFault, IsNotShownByAPush) {
  // One pass of it, twenty times as strong.
  double begun = 0;
  const Made m = made([&](const Moment& at) {
    if (at.time < kOnset || bump(at.position, kPlace) < 0.1) return 0.0;
    if (begun == 0) begun = at.time;
    return at.time < begun + 1 ? 40 * bump(at.position, kPlace) : 0.0;
  });
  EXPECT_LT(repeated(m), 30);
  EXPECT_GT(FaultScreen(m.motion).likeliest(m.left, 1, 8, kNone).size(), 0u);
}

TEST(LocalFault, OfAWaveIsElsewhereAsWell) {
  const ChangeEffect e = local_fault(ChangeChannel::torque, kPlace, kWidth);
  const Made one = made([](const Moment&) { return 0; }),
             wave = made([](const Moment&m) { return std::sin(20 * m.position); });
  // What is left without the one place.
  EXPECT_LT(FaultScreen(one.motion).elsewhere(e, one.left, 1, kOnset, kDuration), 30);
  EXPECT_GT(FaultScreen(wave.motion).elsewhere(e, wave.left, 1, kOnset, kDuration), 100);
}

}  // namespace
}  // namespace backlash::changes
