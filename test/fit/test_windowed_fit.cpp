// SPDX-License-Identifier: BSD-3-Clause
// Fits of straight lines and of a decay, whose answers have closed forms.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/fit/windowed_fit.h"

namespace backlash::fit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// y = slope x + level of the window, with noise.
class Lines : public Windows {
 public:
  Lines(int windows, double noise, double odd_window = 0) : noise_(noise) {
    Random random(3);
    for (int w = 0; w < windows; ++w) {
      MatrixXd points(20, 2);
      for (int i = 0; i < 20; ++i)
        points.row(i) << i, 2.5 * i + 10 * w + noise * random.normal() + (w == 0 ? odd_window * i : 0);
      points_.push_back(points);
    }
  }
  int count() const override { return int(points_.size()); }
  const Priors& shared() const override { return shared_; }
  const Priors& own() const override { return own_; }
  MatrixXd residuals(int w, const MatrixXd& shared, const MatrixXd& own) const override {
    const MatrixXd& p = points_[std::size_t(w)];
    MatrixXd r(p.rows(), shared.cols());
    for (Eigen::Index c = 0; c < shared.cols(); ++c)
      r.col(c) =
          (p.col(1).array() - shared_[0].value(shared(0, c)) * p.col(0).array() - own_[0].value(own(0, c))) /
          noise_;
    return r;
  }
  /// Slope and its standard error by the normal equations, all windows and priors in one matrix.
  std::pair<double, double> in_closed_form() const {
    const Eigen::Index n = 1 + Eigen::Index(points_.size());
    MatrixXd normal = MatrixXd::Zero(n, n);
    VectorXd right = VectorXd::Zero(n);
    normal(0, 0) = std::pow(shared_[0].spread, -2), right[0] = shared_[0].centre * normal(0, 0);
    for (Eigen::Index w = 1; w < n; ++w) {
      normal(w, w) = std::pow(own_[0].spread, -2);
      const MatrixXd& p = points_[std::size_t(w - 1)];
      for (Eigen::Index i = 0; i < p.rows(); ++i) {
        VectorXd row = VectorXd::Zero(n);
        row[0] = p(i, 0), row[w] = 1;
        normal += row * row.transpose() / (noise_ * noise_), right += row * p(i, 1) / (noise_ * noise_);
      }
    }
    const MatrixXd inverse = normal.inverse();
    return {(inverse * right)[0], std::sqrt(inverse(0, 0))};
  }

 private:
  double noise_;
  std::vector<MatrixXd> points_;
  Priors shared_ = {{"slope", 1, 3, false}};
  Priors own_ = {{"level", 0, 100, false}};
};

/// exp(-rate t), of which the rate is a factor, and a value that is known.
class Decay : public Windows {
 public:
  int count() const override { return 1; }
  const Priors& shared() const override { return shared_; }
  const Priors& own() const override { return own_; }
  MatrixXd residuals(int, const MatrixXd& shared, const MatrixXd& own) const override {
    MatrixXd r(30, shared.cols());
    for (Eigen::Index c = 0; c < shared.cols(); ++c)
      for (Eigen::Index i = 0; i < 30; ++i) {
        const double t = 0.1 * double(i);
        r(i, c) = (std::exp(-1.7 * t) -
                   shared_[1].value(shared(1, c)) * std::exp(-shared_[0].value(shared(0, c)) * t) -
                   own_[0].value(own(0, c))) /
                  1e-3;
      }
    return r;
  }

 private:
  Priors shared_ = {{"rate", 1, 2, true}, {"height", 1, 0, false}};
  Priors own_ = {{"level", 0, 1, false}};
};

FitOptions all_but_without_robustness() {
  FitOptions options;
  options.robust = 1e9;
  options.tolerance = 1e-12;
  return options;
}

TEST(WindowedFit, IsTheSolutionOfTheNormalEquations) {
  const Lines lines(7, 0.5);
  WindowedFit fit(lines);
  fit.run(all_but_without_robustness());
  const auto [slope, error] = lines.in_closed_form();
  EXPECT_NEAR(fit.value(0), slope, 1e-5 * error);
  EXPECT_NEAR(3 * std::sqrt(fit.covariance()(0, 0)), error, 1e-5 * error);
}

// Of independent noise of the stated size both errors are the same, as far as 60 windows show a variance: to
// 20 %, 95 %.
TEST(WindowedFit, ClustersAgreeWithNoiseThatIsAsStated) {
  const Lines lines(60, 0.5);
  WindowedFit fit(lines);
  fit.run(all_but_without_robustness());
  EXPECT_NEAR(std::sqrt(fit.clustered_covariance()(0, 0) / fit.covariance()(0, 0)), 1, 0.2);
  EXPECT_NEAR(fit.mean_square(), 1, 0.1);
}

// One window of another slope draws a sum of squares; the loss leaves it out.
TEST(WindowedFit, AWindowThatIsNoneOfThemLosesItsWeight) {
  const Lines lines(10, 0.5, 3);
  WindowedFit plain(lines), robust(lines);
  plain.run(all_but_without_robustness());
  robust.run({});
  EXPECT_GT(plain.value(0), 2.7);
  EXPECT_NEAR(robust.value(0), 2.5, 0.02);
  EXPECT_LT(robust.weight(0), 0.1);
  EXPECT_GT(robust.weight(1), 0.6);
}

// By hand, with Cauchy's loss of each window: where the fit has ended it is the fit's own cost.
TEST(WindowedFit, TheCostElsewhereIsThatOfItsFormula) {
  const Lines lines(3, 0.5, 1);
  WindowedFit fit(lines);
  const FitOptions options;
  fit.run(options);
  EXPECT_NEAR(fit.cost_at(fit.shared, options), fit.cost(), 1e-9 * fit.cost());
  const VectorXd elsewhere = fit.shared.array() + 0.3;
  double cost = elsewhere.squaredNorm();
  for (int w = 0; w < lines.count(); ++w) {
    const VectorXd& own = fit.own[std::size_t(w)];
    const double scale = 4 * 20, squares = lines.residuals(w, elsewhere, own).squaredNorm();
    cost += own.squaredNorm() + scale * std::log(1 + squares / scale);
  }
  EXPECT_NEAR(fit.cost_at(elsewhere, options), cost, 1e-9 * cost);
}

// Ten windows of the same points say the same; one of 20 times their noise says hardly anything.
TEST(WindowedFit, WindowsThatSayLittleHardlyCount) {
  const Lines alike(10, 0.5), one_odd(10, 0.5, 3);
  WindowedFit all(alike), most(one_odd);
  all.run(all_but_without_robustness()), most.run({});
  EXPECT_NEAR(all.windows_that_count(0), 10, 1e-6);
  EXPECT_GT(most.windows_that_count(0), 8.5);
  EXPECT_LT(most.windows_that_count(0), 9.5);
}

TEST(WindowedFit, EndsWhereItWouldNotComeToWhatIsWanted) {
  const Decay decay;
  FitOptions in_vain;
  in_vain.wanted = -1e9;
  WindowedFit whole(decay), part(decay);
  whole.shared[0] = part.shared[0] = 4;
  whole.run({}), part.run(in_vain);
  EXPECT_LT(whole.cost(), 0.5 * part.cost());
}

TEST(WindowedFit, IsTheSameEachTime) {
  const Lines lines(9, 0.5, 1);
  WindowedFit first(lines), second(lines);
  const std::vector<double> elsewhere(1000);  // blocks of another fit lie at other addresses
  first.run({}), second.run({});
  EXPECT_EQ(first.shared, second.shared);
  EXPECT_EQ(first.cost(), second.cost());
}

/// Lines of which the first window cannot be followed.
class Unfollowed : public Lines {
 public:
  using Lines::Lines;
  MatrixXd residuals(int w, const MatrixXd& shared, const MatrixXd& own) const override {
    MatrixXd r = Lines::residuals(w, shared, own);
    if (w == 0) r.array() *= std::numeric_limits<double>::quiet_NaN();
    return r;
  }
};

// Ceres would write an error to the screen of whoever asked for a diagnosis.
TEST(WindowedFit, WhereAWindowCannotBeFollowedNothingIsFoundAndNothingIsWritten) {
  const Unfollowed windows(3, 0.5);
  WindowedFit fit(windows);
  testing::internal::CaptureStderr();
  fit.run({});
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_TRUE(std::isinf(fit.cost()));
}

TEST(WindowedFit, AFactorIsFoundAndWhatIsKnownStays) {
  const Decay decay;
  WindowedFit fit(decay);
  fit.run({});
  EXPECT_NEAR(fit.value(0), 1.7, 1e-4);
  EXPECT_EQ(fit.shared[1], 0);
  EXPECT_EQ(fit.covariance()(1, 1), 1);  // its prior
}

}  // namespace
}  // namespace backlash::fit
