// SPDX-License-Identifier: BSD-3-Clause
// Scores: twice the log likelihood ratio of an effect that begins at an onset, the nuisances eliminated. Sums
// over short blocks, which a live monitor can add one by one, are all that is needed.
#pragma once

#include <functional>
#include <vector>

#include "healthy_model.h"

namespace backlash::changes {

constexpr double kLeastOwn = 1e-3;  // - of its squares that an effect must have for itself. Choice

/// What is known beside the effect: residual, nuisances, variance of the noise.
struct Background {
  Eigen::VectorXd residual;
  Eigen::MatrixXd columns;   // nuisances, and changes that were found
  Eigen::VectorXd spread;    // of each; infinite: not known at all
  double variance = 0;       // of a row of the residual [N^2 m^2]
  Eigen::MatrixXd inverse;   // of the information of the columns
  Eigen::VectorXd estimate;  // of the columns' values

  void add_unknown(const Eigen::MatrixXd& more);  // columns of whose values nothing is known
  void solve();                                   // `inverse`, `estimate` from the rest
  Eigen::VectorXd left() const { return residual - columns * estimate; }
  /// What the best values leave, in variances, with the prior's price of their size: a gain is taken from it.
  double misfit() const {
    return (residual.squaredNorm() - (columns.transpose() * residual).dot(estimate)) / variance;
  }
};

/// Of a row of a record: that of the healthy machine, and of a torque what is unknown of when samples were
/// taken, beyond what was of the healthy records. A sample that is late by e is off by e times the speed;
/// white noise of positions has, twice differentiated up to the cutoff f of samples dt apart,
/// 2 dt (2 pi)^4 f^5 / 5 times its variance.
double noise_variance(const HealthyModel& model, const SampledMotion& motion);

/// Of a record by its healthy machine.
Background background_of(const HealthyModel& model, const SampledMotion& motion,
                         const ChangeSettings& settings);

/// An effect in a record, summed from blocks to the end.
class EffectSums {
 public:
  EffectSums(const SampledMotion& motion, const Eigen::MatrixXd& columns, const Background& background,
             double block, bool ramp);

  struct Score {
    double gain = 0;  // of white noise
    Eigen::VectorXd values;
    Eigen::MatrixXd covariance;
  };
  /// From block `from` to before block `to`. No values where the record does not determine them.
  Score score(std::size_t from, std::size_t to, const Background& background) const;

  /// The sums behind a score; those of channels that share the effect's values add up.
  struct Normal {
    Eigen::VectorXd own;          // squares of the columns
    Eigen::MatrixXd information;  // of the values, the nuisances eliminated
    Eigen::VectorXd moment;
  };
  Normal normal(std::size_t from, std::size_t to, const Background& background) const;
  static Score score(const Normal& normal);

  std::size_t blocks() const { return moments_.size() - 1; }
  double onset(std::size_t block) const { return block_ * double(block); }

 private:
  double block_;
  bool ramp_;
  std::vector<Eigen::MatrixXd> gram_, cross_;  // from block k on
  std::vector<Eigen::VectorXd> moments_;
};

/// By how much the scores of an effect in windows scatter more than those of white noise would, >= 1.
double score_inflation(const SampledMotion& motion, const Eigen::VectorXd& residual,
                       const Eigen::MatrixXd& columns, double variance, double window);

}  // namespace backlash::changes
