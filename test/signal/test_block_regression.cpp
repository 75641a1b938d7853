// SPDX-License-Identifier: BSD-3-Clause
// The share that a regression predicts, against signals whose share is known from how they are made.
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/block_regression.h"

namespace backlash::signal {
namespace {

constexpr int kSamples = 4000, kBlocks = 20;

std::vector<int> blocks() {
  std::vector<int> block;
  for (int k = 0; k < kSamples; ++k) block.push_back(kBlocks * k / kSamples);
  return block;
}

std::vector<double> uniform(std::uint64_t seed) {
  Random random(seed);
  std::vector<double> x;
  for (int k = 0; k < kSamples; ++k) x.push_back(random.uniform(-1, 1));
  return x;
}

TEST(HatFunctions, AddUpToOneAndFollowEachLine) {
  const std::vector<double> x = uniform(1);
  const Eigen::MatrixXd hats = hat_functions(x, 9);
  ASSERT_EQ(hats.cols(), 9);
  EXPECT_NEAR((hats.rowwise().sum() - Eigen::VectorXd::Ones(kSamples)).cwiseAbs().maxCoeff(), 0, 1e-12);
  EXPECT_EQ(hat_functions(std::vector<double>(100, 2.0), 9).cols(), 0);  // a constant has no effect
}

// y = x^2 + noise: of the square of y the part E[x^4] = 1/5 is a function of x.
TEST(PredictedShare, IsThatOfTheFunction) {
  const std::vector<double> x = uniform(2);
  Random random(3);
  Eigen::VectorXd y(kSamples);
  const double noise = 0.3;
  for (int k = 0; k < kSamples; ++k) y[k] = x[std::size_t(k)] * x[std::size_t(k)] + noise * random.normal();
  const double truth = 0.2 / (0.2 + noise * noise);
  const PredictedShare share = predicted_share(hat_functions(x, 17), y, blocks());
  // A few parts in a thousand: 17 values from 3800 samples, and the sampling of noise^2 (sqrt(2 / 4000)).
  EXPECT_NEAR(share.value, truth, 0.02);
  EXPECT_LT(share.lower, truth);
  EXPECT_GT(share.upper, truth);
  EXPECT_LT(share.chance, 0.2 * truth);
}

TEST(PredictedShare, IsNothingOfNoiseWhateverItsColour) {
  for (const double memory : {0.0, 0.9, 0.98}) {  // correlated over up to 50 of the 200 samples of a block
    Random random(4);
    Eigen::VectorXd y(kSamples);
    std::vector<double> time;
    for (int k = 0; k < kSamples; ++k) {
      y[k] = (k > 0 ? memory * y[k - 1] : 0) + random.normal();
      time.push_back(double(k));
    }
    const PredictedShare by_state = predicted_share(hat_functions(uniform(5), 17), y, blocks());
    EXPECT_LT(by_state.value, 0.02) << memory;
    EXPECT_LT(by_state.lower, 0.005) << memory;
    const PredictedShare by_time = predicted_share(hat_functions(time, 6), y, blocks());
    EXPECT_LT(by_time.value, 0.1) << memory;
  }
}

// Where few values are independent, something always seems to be predicted: the share by chance says so.
TEST(PredictedShare, IsSeldomBeyondChanceOfShortColouredNoise) {
  int beyond = 0;
  const int trials = 60;
  for (int trial = 0; trial < trials; ++trial) {
    Random random(100, std::uint32_t(trial));
    Eigen::VectorXd y(kSamples);
    std::vector<double> x;
    for (int k = 0; k < kSamples; ++k) {
      y[k] = (k > 0 ? 0.97 * y[k - 1] : 0) + random.normal();
      x.push_back(std::sin(0.004 * k));  // two and a half periods
    }
    const PredictedShare share = predicted_share(hat_functions(x, 17), y, blocks());
    beyond += share.value > share.chance;
  }
  EXPECT_LE(beyond, 6);  // binomial: 1.5 of 60 are expected, 7 or more have a chance below 0.1 %
}

// What only one block shows cannot be predicted from the others.
TEST(PredictedShare, IsNothingOfWhatHappensOnce) {
  std::vector<double> time;
  Eigen::VectorXd y = Eigen::VectorXd::Zero(kSamples);
  for (int k = 0; k < kSamples; ++k) time.push_back(double(k));
  y.segment(1000, 200).setConstant(5);
  EXPECT_EQ(predicted_share(hat_functions(time, 40), y, blocks()).value, 0);
}

TEST(PredictedShare, NeedsBlocksAndStates) {
  const Eigen::VectorXd y = Eigen::VectorXd::Ones(30);
  EXPECT_EQ(predicted_share(Eigen::MatrixXd(30, 0), y, std::vector<int>(30, 0)).value, 0);
  EXPECT_EQ(predicted_share(Eigen::MatrixXd::Ones(30, 1), y, std::vector<int>(30, 0)).value, 0);
}

}  // namespace
}  // namespace backlash::signal
