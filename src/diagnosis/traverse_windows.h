// SPDX-License-Identifier: BSD-3-Clause
// What a machine leaves of the windows of a record: of the load's position where that is recorded, else of
// the motor's torque.
#pragma once

#include <vector>

#include "backlash_diagnosis/fit/windowed_fit.h"
#include "traverse_motion.h"

namespace backlash::diagnosis {

constexpr double kUnknownLaw = 0.2;  ///< of a flank's deflection, 95 %: laws of teeth in no prior: simulation

/// How little is known of the law of the teeth: 1, and less of a commissioned machine that left little, as
/// another law would have left more; to 0.
double unknown_law(const TraverseData& data, const GapTraverseSettings& settings);

class TraverseWindows : public fit::Windows {
 public:
  /// `data` must outlive it. `part`: of each window, from its begin on, that counts.
  TraverseWindows(const TraverseData& data, const GapTraverseSettings& settings,
                  std::vector<TraverseWindow> windows, double part = 1);

  double noise = 1;  ///< times that of a sample, as which what is left counts

  int count() const override { return int(windows_.size()); }
  const fit::Priors& shared() const override { return shared_; }
  const fit::Priors& own() const override { return own_; }
  Eigen::MatrixXd residuals(int w, const Eigen::MatrixXd& shared, const Eigen::MatrixXd& own) const override;

  /// What is left of the torque [N m], not whitened, and the samples of the record that it belongs to.
  Eigen::VectorXd torque_left(int w, const Eigen::VectorXd& shared, const Eigen::VectorXd& own,
                              std::vector<std::size_t>* samples) const;
  /// N m, that the declared terms take of the load.
  double load_torque(int w) const { return windows_[std::size_t(w)].load_torque; }
  /// N m through the teeth about each sample.
  Eigen::VectorXd teeth(int w, const Eigen::VectorXd& shared, const Eigen::VectorXd& own) const;
  /// Expected of noise alone, of the sum of squares of a window.
  double squares_of_noise(int w) const { return weights_[std::size_t(w)].of_noise / (noise * noise); }

 private:
  /// How what is left of one window counts.
  struct Weights {
    std::vector<Eigen::Index> counted;  // samples
    Eigen::MatrixXd deviation;  // Cholesky factor of the covariance of what is left there, N m; empty: white
    double of_noise = 0;        // expected of noise alone, of the sum of squares
  };

  bool by_load() const { return !data_.load.empty(); }
  bool moves_load(int value) const;
  Weights weights_of(const TraverseWindow& window, double part) const;
  TraverseRun run_of(int w, const Eigen::MatrixXd& shared, const Eigen::MatrixXd& own,
                     Eigen::Index column) const;

  const TraverseData& data_;
  std::vector<TraverseWindow> windows_;
  std::vector<Weights> weights_;
  fit::Priors shared_, own_;
};

}  // namespace backlash::diagnosis
