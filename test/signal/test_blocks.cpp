// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/blocks.h"

namespace backlash::signal {
namespace {

TEST(Blocks, MeansLeaveTheRestOut) {
  EXPECT_EQ(block_means({1, 3, 5, 7, 100}, 2), (std::vector<double>{2, 6}));
  EXPECT_TRUE(block_means({1}, 2).empty());
}

TEST(Blocks, FewValuesHaveNoError) {
  const Measured mean = batch_mean({1, 2, 3});
  EXPECT_DOUBLE_EQ(mean.value, 2);
  EXPECT_TRUE(std::isnan(mean.standard_error));
}

TEST(SteadyRange, LeavesStartAndEndOut) {
  // Settles as exp(-k / 10) from 20 % off: below 1e-3 from k = 53 on (10 ln 200 = 52.98); stops at 190.
  std::vector<double> speed;
  for (int k = 0; k < 200; ++k) speed.push_back(k < 190 ? 2 * (1 - 0.2 * std::exp(-k / 10.0)) : 0);
  const auto [first, last] = steady_range(speed, 0.5, 1e-3);
  EXPECT_NEAR(double(first), 53, 1);  // the median is not quite that of the settled speed
  EXPECT_EQ(last, 190u);
  EXPECT_EQ(steady_range(speed, 0.1, 1e-3).first, 20u);  // no more than it may
  EXPECT_EQ(steady_range({1, 1, 1}, 0.5, 0).second, 3u);
}

TEST(Jackknife, OfAMeanIsTheTextbookError) {
  // One row per block: the jackknife of a mean is exactly s / sqrt(n).
  const Eigen::VectorXd b = (Eigen::VectorXd(5) << 1, 2, 4, 7, 11).finished();
  const Eigen::VectorXd r = b.array() - b.mean();
  const double s = std::sqrt(r.squaredNorm() / 4);
  EXPECT_NEAR(jackknife_covariance(Eigen::MatrixXd::Ones(5, 1), r, {0, 1, 2, 3, 4})(0, 0), s * s / 5, 1e-12);
}

TEST(Jackknife, RepeatedRowsAreNoNews) {
  // Every row ten times, in one block: the error must stay that of the single rows.
  const Eigen::VectorXd b = (Eigen::VectorXd(6) << 1, 2, 4, 7, 11, 3).finished();
  const Eigen::VectorXd r = b.array() - b.mean();
  std::vector<std::size_t> single, tenfold;
  Eigen::VectorXd many(60);
  for (int i = 0; i < 6; ++i) single.push_back(i);
  for (int i = 0; i < 60; ++i) many[i] = r[i / 10], tenfold.push_back(i / 10);
  EXPECT_NEAR(jackknife_covariance(Eigen::MatrixXd::Ones(60, 1), many, tenfold)(0, 0),
              jackknife_covariance(Eigen::MatrixXd::Ones(6, 1), r, single)(0, 0), 1e-12);
}

TEST(Jackknife, RefusesWhatOneBlockDecides) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Ones(8, 2);
  a.col(1).setZero();
  a(7, 1) = 1;
  const Eigen::VectorXd r = Eigen::VectorXd::Ones(8);
  EXPECT_THROW(jackknife_covariance(a, r, {0, 0, 1, 1, 2, 2, 3, 3}), CannotIdentify);
  EXPECT_THROW(jackknife_covariance(a, r, {0, 0, 0, 0, 1, 1, 2, 2}), CannotIdentify);
}

}  // namespace
}  // namespace backlash::signal
