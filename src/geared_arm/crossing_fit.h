// SPDX-License-Identifier: BSD-3-Clause
// Plays and teeth that explain the torques of the motors about all turns of the load: fit/windowed_fit.h with
// the arm of geared_arm/traverse.h.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "backlash_diagnosis/fit/windowed_fit.h"
#include "crossing_motion.h"

namespace backlash::geared_arm {

constexpr double kLargestGap = 0.03;  // rad, that is looked for; choice

/// What an arm leaves of its motors' torques, whitened: of each joint the means over some samples.
class CrossingWindows : public fit::Windows {
 public:
  /// `data` must outlive it.
  explicit CrossingWindows(const CrossingData& data);

  /// The gap of this joint is known.
  void hold_gap(std::size_t joint, double gap);
  /// How much the gaps that turns say differ, of gaps as large as these.
  void vary_about(const CrossingMachine& machine);
  int count() const override { return int(data_.windows.size()); }
  const fit::Priors& shared() const override { return shared_; }
  const fit::Priors& own() const override { return own_; }
  int channels() const override { return int(data_.joints.size()); }
  Eigen::MatrixXd residuals(int w, const Eigen::MatrixXd& shared, const Eigen::MatrixXd& own) const override;

  CrossingMachine machine(const Eigen::VectorXd& shared) const;
  /// Of one window, as mesh_torques() has them.
  Eigen::VectorXd own_of(const Eigen::VectorXd& own) const;
  const CrossingData& data() const { return data_; }

 private:
  using Factors = std::vector<std::vector<Eigen::MatrixXd>>;  // per window, per joint
  Eigen::VectorXd residual(int w, const CrossingMachine& machine, const Eigen::MatrixXd& mesh) const;

  const CrossingData& data_;
  fit::Priors shared_, own_;
  std::shared_ptr<const Factors> factors_;  // Cholesky's, of the covariances of what is left; never copied
};

class CrossingFit {
 public:
  explicit CrossingFit(const CrossingData& data);

  /// The same with a gap of this joint that does not move.
  CrossingFit held(std::size_t joint, double gap) const;
  /// At most so many steps; ends where they would not come to a cost that is wanted.
  void run(int steps, double wanted = std::numeric_limits<double>::infinity());
  /// Takes, joint by joint, the gap that explains most of those that are to be tried about one, all else as
  /// it is; what the turns have of their own is forgotten: it would hold on to the gap that it was fitted
  /// with.
  void scan(const std::function<std::vector<double>(double)>& gaps_about);

  double gap(std::size_t joint) const { return machine()[joint][kCrossingGap]; }
  CrossingMachine machine() const { return windows_->machine(fit_.shared); }
  Eigen::VectorXd own(std::size_t window) const { return windows_->own_of(fit_.own[window]); }
  /// Minus twice the logarithm of the likelihood of the residuals and of the deviations from what is known.
  double cost() const { return fit_.cost(); }
  /// Root of the mean square of a joint's weighted residuals that most windows do not exceed: about 1 where
  /// the equations hold.
  double misfit(std::size_t joint) const;

  struct Errors {
    double own = 0, clustered = 0;  // rad, standard errors of the gap
    double turns = 0;               // how many turns determine it, better ones counting more
  };
  std::vector<Errors> errors() const;  // per joint

 private:
  void set_gap(std::size_t joint, double gap);
  /// All else as it is.
  double cost_with(std::size_t joint, double gap) const;
  /// The same on other windows of the same record.
  void take(const CrossingWindows& windows);

  std::shared_ptr<const CrossingWindows> windows_;
  fit::WindowedFit fit_;
};

}  // namespace backlash::geared_arm
