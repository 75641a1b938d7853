// SPDX-License-Identifier: BSD-3-Clause
// The part of residuals and sensitivities that the machine's own parameters cannot explain.
#pragma once

#include <Eigen/Core>

#include "../fit/joint_fit.h"

namespace backlash::identification {

/// Projects rows onto what is orthogonal to the sensitivities of a fit: the first `rows` rows, those of the
/// records.
class OrthogonalPart {
 public:
  OrthogonalPart(const MachineFit& fit, Eigen::Index rows);

  Eigen::VectorXd of(const Eigen::VectorXd& column) const;
  /// That of the residuals of the fit.
  const Eigen::VectorXd& residuals() const { return residuals_; }
  /// Orthonormal columns that span the sensitivities.
  const Eigen::MatrixXd& basis() const { return basis_; }

 private:
  Eigen::MatrixXd basis_;
  Eigen::VectorXd residuals_;
};

}  // namespace backlash::identification
