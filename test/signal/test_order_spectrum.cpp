// SPDX-License-Identifier: BSD-3-Clause
// The spectrum over a position against closed forms: a wave over an even sweep, whose sums are known.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_spectrum.h"

namespace backlash::signal {
namespace {

/// y = amplitude * sin(order q + 0.7), to and fro over `travel` as a sine, which dwells at its ends: the lobe
/// of a line is a little uneven. All samples count up to `highest`.
OrderSamples wave(double order, double travel, std::size_t count, double amplitude = 2,
                  double highest = 5000) {
  OrderSamples s;
  for (std::size_t k = 0; k < count; ++k) {
    const double q = 0.3 + 0.5 * travel * (1 - std::cos(2 * M_PI * 3.37 * double(k) / double(count)));
    s.position.push_back(q);
    s.value.push_back(amplitude * std::sin(order * q + 0.7));
    s.carrier.push_back(1);
    s.highest.push_back(highest);
  }
  return s;
}

void add_noise(OrderSamples& s, double deviation, std::uint64_t seed) {
  Random random(seed);
  for (double& v : s.value) v += deviation * random.normal();
}

// A wave of which all is explained. Lines are an eighth of a resolution apart; the peak is found between them
// within half of that, from where a fit goes on.
TEST(OrderSpectrum, FindsOrdersThatAreNoWholeNumbers) {
  for (const double order : {9.41, 18.667, 36.0, 110.0, 280.0, 1000.3, 1840.7}) {
    const OrderSpectrum spectrum = order_spectrum(wave(order, 1.7, 5000), 2000);
    EXPECT_NEAR(spectrum.resolution, 2 * M_PI / 1.7, 1e-3);  // samples need not meet the ends
    const auto peaks = strongest_orders(spectrum, 3);
    ASSERT_FALSE(peaks.empty());
    EXPECT_NEAR(peaks[0].order, order, spectrum.resolution / 16) << order;
    EXPECT_GT(peaks[0].share, 0.94) << order;  // theory: 1.3 % between lines, 4 % by the grid of positions
    EXPECT_LT(peaks[0].share, 1.05) << order;
  }
}

// Over whole periods of an even sweep the sums are exact: |sum y exp(-j n q)|^2 2 / N = N A^2 / 2 at the
// order, and sinc^2 of the distance in resolutions beside it.
TEST(OrderSpectrum, OfAnEvenSweepIsASinc) {
  constexpr std::size_t kCount = 20000;
  OrderSamples s;
  for (std::size_t k = 0; k < kCount; ++k) {
    s.position.push_back(2 * M_PI * double(k) / kCount);
    s.value.push_back(3 * std::sin(200 * s.position.back()));
    s.carrier.push_back(1);
    s.highest.push_back(1e4);
  }
  const OrderSpectrum spectrum = order_spectrum(s, 400);
  for (std::size_t i = 0; i < spectrum.taken.size(); ++i) {
    const double distance = spectrum.first + double(i) * spectrum.step - 200;
    if (std::fabs(distance) > 3) continue;
    const double x = M_PI * distance, sinc = std::fabs(x) < 1e-3 ? 1 : std::sin(x) / x;
    // theory: the mirrored line at -200 adds up to 1/400 of the amplitude
    EXPECT_NEAR(spectrum.taken[i], kCount * 4.5 * sinc * sinc, 0.006 * kCount * 4.5) << distance;
  }
}

// Where the lines are solved exactly: the share by a least-squares solution of the same columns.
TEST(OrderSpectrum, LowOrdersAreTheLeastSquaresSolutionBesideKnownColumns) {
  OrderSamples s = wave(6.2, 2.5, 800);
  add_noise(s, 0.5, 4);
  Eigen::MatrixXd columns(800, 2);
  for (int k = 0; k < 800; ++k) columns.row(k) << 1, s.position[std::size_t(k)];
  const Eigen::MatrixXd known = orthonormal_basis(columns);
  Eigen::Map<Eigen::VectorXd> y(s.value.data(), 800);
  y -= (known * (known.transpose() * y)).eval();
  const OrderSpectrum spectrum = order_spectrum(s, 100, known);
  for (const std::size_t i : {0u, 5u, 12u, 30u}) {
    const double order = spectrum.first + double(i) * spectrum.step;
    Eigen::MatrixXd all(800, 4);
    for (int k = 0; k < 800; ++k)
      all.row(k) << 1, s.position[std::size_t(k)], std::sin(order * s.position[std::size_t(k)]),
          std::cos(order * s.position[std::size_t(k)]);
    const Eigen::VectorXd left = y - all * solve_least_squares(all, y).x;
    EXPECT_NEAR(spectrum.share[i], 1 - left.squaredNorm() / y.squaredNorm(), 1e-9) << order;
  }
}

TEST(OrderSpectrum, ACarrierUndoesTheDirection) {
  OrderSamples s = wave(36.4, 1.7, 5000);
  for (std::size_t k = 0; k < s.value.size(); ++k) {
    const double direction = k % 1000 < 500 ? 1 : -1;
    s.carrier[k] = direction;
    s.value[k] *= direction;
  }
  EXPECT_NEAR(strongest_orders(order_spectrum(s, 500), 1).at(0).order, 36.4, 3.7 / 16);
}

// White noise of deviation 1: what a line takes has the mean of two squares, 2, and among 16 000 lines, of
// which about 2000 are independent, none reaches 2 (ln 2000 + 7) = 29 but once in a thousand trials.
TEST(OrderSpectrum, OfNoiseHasNoPeak) {
  OrderSamples s = wave(1, 2 * M_PI, 9000, 0);
  add_noise(s, 1, 11);
  const OrderSpectrum spectrum = order_spectrum(s, 2000);
  double sum = 0;
  for (const double taken : spectrum.taken) sum += taken;
  EXPECT_NEAR(sum / double(spectrum.taken.size()), 2, 0.2);
  EXPECT_LT(strongest_orders(spectrum, 1).at(0).taken, 29);
}

// Half of the samples are too fast for orders above 100: there they must not count, whatever they hold.
TEST(OrderSpectrum, SamplesCountUpToTheirOwnOrder) {
  OrderSamples s = wave(250, 1.7, 6000);
  for (std::size_t k = 0; k < s.value.size(); k += 2) s.highest[k] = 100, s.value[k] = 30;
  const OrderPeak peak = strongest_orders(order_spectrum(s, 500), 1, 150).at(0);
  EXPECT_NEAR(peak.order, 250, 3.7 / 16);
  EXPECT_GT(peak.share, 0.94);
  const OrderSpectrum all_fast = order_spectrum(wave(250, 1.7, 6000, 1, 120), 500);
  EXPECT_LE(all_fast.first + double(all_fast.share.size()) * all_fast.step, 121);
}

TEST(OrderSpectrum, OfTooLittleIsEmpty) {
  EXPECT_TRUE(order_spectrum({}, 100).share.empty());
  EXPECT_TRUE(order_spectrum(wave(20, 1.7, 10), 100).share.empty());
  EXPECT_TRUE(order_spectrum(wave(20, 0, 1000), 100).share.empty());
  EXPECT_TRUE(strongest_orders({}, 3).empty());
}

// Goal: 30 s at 1 kHz, 10 000 lines and more in well under a second; sixty times that is a loaded machine.
TEST(OrderSpectrum, IsFast) {
  const OrderSamples s = wave(700, 20, 30000);
  const auto before = std::chrono::steady_clock::now();
  const OrderSpectrum spectrum = order_spectrum(s, 1000);
  EXPECT_GT(spectrum.share.size(), 10000u);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count(), 6);
}

}  // namespace
}  // namespace backlash::signal
