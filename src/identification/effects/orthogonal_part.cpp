// SPDX-License-Identifier: BSD-3-Clause
#include "orthogonal_part.h"

namespace backlash {

OrthogonalPart::OrthogonalPart(const MachineFit& fit, Eigen::Index rows)
    : qr_((fit.fit.jacobian.topRows(rows) * fit.fit.jacobian.colwise().norm().cwiseInverse().asDiagonal())
              .householderQr()),
      columns_(fit.fit.jacobian.cols()),
      residuals_(of(fit.fit.residuals.head(rows))) {}

Eigen::VectorXd OrthogonalPart::of(const Eigen::VectorXd& column) const {
  Eigen::VectorXd rotated = qr_.householderQ().transpose() * column;
  rotated.head(columns_).setZero();
  return qr_.householderQ() * rotated;
}

}  // namespace backlash
