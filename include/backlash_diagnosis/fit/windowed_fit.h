// SPDX-License-Identifier: BSD-3-Clause
// A machine fitted to stretches of a record: nonlinear least squares over values that all windows share and
// values that belong to one window (where it starts, a torque that nothing else explains). Every value has a
// normal prior and is counted in its standard deviations z, so that the cost is
//
//   |z_shared|^2 + sum over windows w of (|z_w|^2 + sum over channels of rho(|r_w(z_shared, z_w)|^2))
//
// with whitened residuals r_w and Cauchy's loss rho over a channel of a window as a whole: one that the
// machine does not follow loses weight. Solved by Levenberg and Marquardt's method with the Schur complement
// of Ceres Solver (Agarwal, Mierle and others 2022); slopes by differences. The answer is the same on any
// number of threads.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

namespace backlash::fit {

/// What is known of a value before the record: value(z) = centre exp(spread z) of a factor, else centre +
/// spread z.
struct Prior {
  std::string name;   ///< as a report names it
  double centre = 0;  ///< > 0 of a factor
  double spread = 1;  ///< one standard deviation, of the logarithm of a factor; 0: it is known
  bool factor = true;
  double step = 1e-3;  ///< spreads, by which it is moved for a difference: large beside rounding and what the
                       ///< integration leaves, small beside what bends the residuals
  double value(double z) const;
};
using Priors = std::vector<Prior>;

/// A record in windows, and a machine that predicts them.
class Windows {
 public:
  virtual ~Windows() = default;
  virtual int count() const = 0;
  virtual const Priors& shared() const = 0;
  virtual const Priors& own() const = 0;
  /// Rows of a window are so many equal parts, one after the other.
  virtual int channels() const { return 1; }
  /// Whitened residuals of window `w`, a column for each column of `shared` (in spreads) and of `own`. Called
  /// from several threads, for one window each.
  virtual Eigen::MatrixXd residuals(int w, const Eigen::MatrixXd& shared,
                                    const Eigen::MatrixXd& own) const = 0;
};

struct FitOptions {
  int iterations = 30;      ///< at most
  double radius = 100;      ///< of the first trust region, in spreads
  double robust = 4;        ///< > 0: squares per row, with which a channel of a window has half of its weight
  double tolerance = 1e-5;  ///< relative gain of the cost, at which it ends
  /// Cost, without which the fit is of no use: it ends where ten steps at the pace of one would not come
  /// there.
  double wanted = std::numeric_limits<double>::infinity();
  bool central = false;  ///< differences to both sides for the errors of the answer: those to one side add
                         ///< information where values nearly mix
};

class WindowedFit {
 public:
  /// `windows` must outlive it.
  explicit WindowedFit(const Windows& windows);

  Eigen::VectorXd shared;            ///< in spreads; where run() begins, and what it finds
  std::vector<Eigen::VectorXd> own;  ///< of each window
  void run(const FitOptions& options);

  double value(int which) const { return windows_->shared()[std::size_t(which)].value(shared[which]); }
  double cost() const { return cost_; }  ///< infinite where no machine could be followed
  /// With other shared values, those of the windows as they are.
  double cost_at(const Eigen::VectorXd& others, const FitOptions& options) const;
  /// Of the squares of a window's channel, 0 to 1, at what run() found.
  double weight(int window, int channel = 0) const;
  /// Residuals of a window there.
  const Eigen::VectorXd& residual(int window) const { return parts_[std::size_t(window)].residual; }
  /// Mean square of a residual, windows by their weights: 1 where whitening is right.
  double mean_square() const;
  /// Covariance of the shared values in spreads: of the fit, and with windows as clusters (sandwich; Liang
  /// and Zeger 1986).
  Eigen::MatrixXd covariance() const;
  /// Its inverse: what the windows say, their own values eliminated, and one of each prior.
  Eigen::MatrixXd information() const;
  Eigen::MatrixXd clustered_covariance() const;
  /// How many windows determine a shared value, those that say more of it counting more.
  double windows_that_count(Eigen::Index which) const;

 private:
  friend struct Evaluation;
  friend class WindowCost;
  friend class OwnCost;
  struct Part {
    Eigen::VectorXd residual;
    Eigen::MatrixXd slopes;  // shared, then own
  };
  enum class Slopes { none, own, all };
  void evaluate(Slopes slopes);
  Part part_of(int window, const Eigen::VectorXd& own_values, Slopes slopes) const;
  /// Own values of each window, with the shared ones as they are: steps of all together from a poor start
  /// lead astray.
  void settle();
  void reduce(int window, Eigen::MatrixXd* information, Eigen::VectorXd* score) const;

  const Windows* windows_;
  std::vector<Part> parts_;
  double robust_ = 0, cost_ = 0;
  bool central_ = false;
};

}  // namespace backlash::fit
