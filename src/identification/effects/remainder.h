// SPDX-License-Identifier: BSD-3-Clause
// What the machine's own parameters leave of residuals and of sensitivities.
#pragma once

#include <Eigen/Core>
#include <Eigen/QR>

#include "../fit/joint_fit.h"

namespace backlash {

class Remainder {
 public:
  /// Of the first `rows` rows of the fit, those of the records.
  Remainder(const MachineFit& fit, Eigen::Index rows)
      : qr_((fit.fit.jacobian.topRows(rows) * fit.fit.jacobian.colwise().norm().cwiseInverse().asDiagonal())
                .householderQr()),
        columns_(fit.fit.jacobian.cols()),
        left_(without(fit.fit.residuals.head(rows))) {}

  /// The part of a column that no change of the parameters can take up.
  Eigen::VectorXd without(const Eigen::VectorXd& column) const {
    Eigen::VectorXd rotated = qr_.householderQ().transpose() * column;
    rotated.head(columns_).setZero();
    return qr_.householderQ() * rotated;
  }
  const Eigen::VectorXd& left() const { return left_; }

 private:
  Eigen::HouseholderQR<Eigen::MatrixXd> qr_;
  Eigen::Index columns_;
  Eigen::VectorXd left_;
};

}  // namespace backlash
