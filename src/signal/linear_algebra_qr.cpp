// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/QR>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::signal {

QrSolution solve_least_squares(const MatrixView& a, const Eigen::Ref<const Eigen::VectorXd>& b) {
  const Eigen::MatrixXd columns = a;
  const Eigen::VectorXd right = b;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  const Eigen::VectorXd diagonal = qr.matrixR().diagonal().cwiseAbs();
  const double largest = diagonal.maxCoeff();
  return {qr.solve(right), largest > 0 ? diagonal.minCoeff() / largest : 0};
}

Eigen::MatrixXd orthonormal_basis(const MatrixView& a) {
  constexpr double kDependent = 1e-13;  // choice: of a column's length, a few hundred roundings
  Eigen::MatrixXd basis = a;
  for (Eigen::Index i = 0; i < basis.cols(); ++i) {
    const double length = basis.col(i).norm();
    // Twice is enough for orthogonality to rounding (Giraud et al. 2005).
    for (int pass = 0; pass < 2; ++pass)
      for (Eigen::Index k = 0; k < i; ++k) basis.col(i) -= basis.col(k).dot(basis.col(i)) * basis.col(k);
    const double left = basis.col(i).norm();
    basis.col(i) *= left > kDependent * length ? 1 / left : 0;
  }
  return basis;
}

}  // namespace backlash::signal
