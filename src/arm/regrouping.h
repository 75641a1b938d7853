// SPDX-License-Identifier: BSD-3-Clause
// What of the links' standard parameters the motions distinguish (Gautier 1991, J. Robotic Systems 8:485):
// the columns of the regressor that are no combination of those before them lead a base parameter each, the
// others go with them. Torques depend on the base parameters alone: the rest may be anything.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "backlash_diagnosis/arm/fit.h"

namespace backlash::arm {

class Regrouping {
 public:
  Regrouping(const Chain& chain, const std::vector<FittedMotion>& motions);

  std::vector<BaseParameter> base_parameters(const Chain& chain, const std::vector<BodyParameters>& links,
                                             const Eigen::MatrixXd& covariance) const;
  const std::vector<Shown>& shown() const { return shown_; }

  /// The physical bodies that move as `links` do and are nearest to the declared ones, by the divergence of
  /// fit.h: what the motions do not show stays as it was declared. Parameters that no motion shows are
  /// exactly the declared ones where such bodies exist. All given bodies must be physical.
  std::vector<BodyParameters> nearest(const std::vector<BodyParameters>& declared,
                                      const std::vector<BodyParameters>& links) const;

 private:
  std::vector<Eigen::Index> kept_;  // of those that lead
  std::vector<Shown> shown_;
  Eigen::MatrixXd regroup_;  // base parameters = regroup_ * standard ones
};

}  // namespace backlash::arm
