// SPDX-License-Identifier: BSD-3-Clause
#include "orthogonal_part.h"

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::identification {

OrthogonalPart::OrthogonalPart(const MachineFit& fit, Eigen::Index rows)
    : basis_(signal::orthonormal_basis(fit.fit.jacobian.topRows(rows) *
                                       fit.fit.jacobian.colwise().norm().cwiseInverse().asDiagonal())),
      residuals_(of(fit.fit.residuals.head(rows))) {}

Eigen::VectorXd OrthogonalPart::of(const Eigen::VectorXd& column) const {
  return column - basis_ * (basis_.transpose() * column);
}

}  // namespace backlash::identification
