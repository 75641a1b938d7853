// SPDX-License-Identifier: BSD-3-Clause
// Fits a machine to all crossings of the gap: least squares with priors by Levenberg and Marquardt's method,
// the own values of each crossing eliminated (Schur complement).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "traverse_motion.h"

namespace backlash::diagnosis {

/// What is known of a value: normal about `value`, or its logarithm is (`factor`).
struct TraversePrior {
  double value = 0, spread = 1;
  bool factor = true;
};
using TraverseMatrix = Eigen::Matrix<double, kTraverseOwn, kTraverseOwn>;
using TraversePriors = std::array<TraversePrior, kTraverseValues>;

TraversePriors traverse_priors(const TraverseData& data, const GapTraverseSettings& settings);

class TraverseFit {
 public:
  /// Uses `windows` of the data's, and begins with a gap of `first_gap` spreads.
  TraverseFit(const TraverseData& data, const TraversePriors& priors, std::vector<TraverseWindow> windows,
              double first_gap);
  /// Another fit's machine on these windows, of its data or of others, whose own values are fitted to it.
  TraverseFit(const TraverseFit& other, const TraverseData& data, std::vector<TraverseWindow> windows);

  /// At most so many steps; crossings that the machine does not follow are left out on the way.
  void run(int iterations);

  double value(int which) const { return value(which, z_[which]); }
  /// In spreads from what was known.
  double deviation(int which) const { return z_[which]; }
  double cost() const { return cost_; }
  int windows() const { return int(windows_.size()); }
  int left_out() const;
  /// Median over the crossings of the rms residual, in noises.
  double misfit() const;
  /// N m, rms over the crossings of the torque on the motor that nothing else tells.
  double untold() const;
  /// Of the logarithm of the gap: the fit's, and by crossings as clusters (sandwich).
  double standard_error() const;
  double clustered_error() const;

 private:
  /// Normal equations of one crossing.
  struct Part {
    Eigen::MatrixXd shared, mixed;
    TraverseMatrix own;
    Eigen::VectorXd toward;
    TraverseOwn own_toward;
  };

  /// How what is left of one crossing counts.
  struct Weights {
    std::vector<Eigen::Index> counted;  // samples
    Eigen::MatrixXd deviation;          // Cholesky factor of the covariance of what is left there, N m
    double of_noise = 0;                // expected of noise alone, of the sum of squares
  };

  double value(int which, double z) const;
  void weigh(const TraverseWindow& window);
  TraverseMachine machine(const Eigen::VectorXd& z) const;
  TraverseRun run_of(std::size_t window, const TraverseMachine& machine, const TraverseOwn& own) const;
  /// With one value moved by a difference, for each of the machine; then those for the values of a crossing
  /// and for none.
  std::vector<TraverseMachine> moved_machines() const;
  TraverseRun moved_run(std::size_t window, const std::vector<TraverseMachine>& machines, int which) const;
  void linearise(std::size_t first, std::size_t last, const std::vector<TraverseMachine>& machines);
  /// Of residuals and their slopes at each sample of a window.
  Part part_of(std::size_t window, const Eigen::VectorXd& residual, const Eigen::MatrixXd& all_slopes) const;
  /// Sum of them in standard deviations, independent of each other.
  double squares_of(std::size_t window, const Eigen::VectorXd& residual) const;
  double cost_of(const Eigen::VectorXd& z, const std::vector<TraverseOwn>& own,
                 std::vector<double>* rms) const;
  bool iterate();
  /// Own values of crossings anew, with the machine as it is.
  void settle(const std::vector<char>& which);
  TraverseOwn settled(std::size_t window) const;
  void leave_out();

  const TraverseData& data_;
  TraversePriors priors_;
  std::vector<TraverseWindow> windows_;
  std::vector<Weights> weights_;
  std::vector<char> used_;
  std::vector<TraverseOwn> own_;  // in spreads
  TraverseOwn own_spread_;
  std::vector<Part> parts_;  // at the last step
  Eigen::VectorXd z_;
  double cost_ = 0, gain_ = 0, damping_ = 0;
};

}  // namespace backlash::diagnosis
