// SPDX-License-Identifier: BSD-3-Clause
// What is known of an arm before any record: that it is physical, and about what was declared (fit.h).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit_model.h"

namespace backlash::arm {

class Priors {
 public:
  Priors() = default;
  Priors(const ArmRig& rig, const FitFreedom& freedom, const FitSettings& settings,
         const std::vector<char>& moves);

  /// Puts values that a fit can start from where the rig declares none.
  void begin(State& state);

  /// The step that minimises 1/2 x^T H x - g^T x plus the priors at state + x, where `free` is set.
  /// References follow the state in all but the shape of the links, so that declared masses say nothing of
  /// the torque constants.
  Eigen::VectorXd step(const Eigen::MatrixXd& h, const Eigen::VectorXd& g, const State& state,
                       const std::vector<char>& free);

  /// Second derivative of the priors at a state.
  Eigen::MatrixXd curvature(const State& state) const;

 private:
  struct Divergence {
    Eigen::Index place;       // of the ten
    Eigen::Matrix4d inverse;  // of the reference
  };
  struct Positive {
    Eigen::Index place;
    double reference;
  };
  struct Normal {
    Eigen::Index place;
    double centre, weight;  // of the value, 1 / variance
  };
  /// Value, gradient and curvature at a vector of all values; infinite outside of what is physical.
  double value(const Eigen::VectorXd& x) const;
  void add_derivatives(const Eigen::VectorXd& x, Eigen::VectorXd& gradient, Eigen::MatrixXd& curvature) const;
  Eigen::VectorXd vector_of(const State& state) const;
  void follow(const Eigen::VectorXd& x);
  void set_constants(const std::vector<double>& own, double common);

  Layout layout_;
  double weight_ = 1;
  std::vector<signal::Measured> weights_;  // kg, of the bodies
  double mass_ = 1, radius_ = 0.1;         // kg, m, of a payload to start from
  double shift_ = 0.1;                     // of offsets, per Coulomb friction
  std::vector<Eigen::Index> day_;          // joints whose friction is of another day
  bool payload_ = false;                   // there is one per marked state
  std::vector<Divergence> bodies_;
  std::vector<Positive> positive_;
  std::vector<Normal> normal_;
  std::vector<Eigen::Index> kappas_;  // of the constants that are not exact
  Eigen::MatrixXd kappa_precision_;   // of all of them together
};

}  // namespace backlash::arm
