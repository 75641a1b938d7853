// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/linear_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace backlash::signal {
namespace {

using Eigen::MatrixXd;

/// Of plain matrices: every other type of an operand would be compiled anew.
MatrixXd solve_plain(const MatrixXd& a, const MatrixXd& b) {
  return a.ldlt().solve(b);
}

}  // namespace

Eigen::MatrixXd product(const MatrixView& a, const MatrixView& b) {
  return a * b;
}

Eigen::MatrixXd transposed_product(const MatrixView& a, const MatrixView& b) {
  return a.transpose() * b;
}

Eigen::MatrixXd gram(const MatrixView& a) {
  return transposed_product(a, a);
}

Eigen::MatrixXd solve_symmetric(const MatrixView& a, const MatrixView& b) {
  return solve_plain(a, b);
}

Eigen::MatrixXd symmetric_inverse(const MatrixView& a) {
  return solve_plain(a, MatrixXd::Identity(a.rows(), a.rows()));
}

double smallest_pivot(const MatrixView& a) {
  return Eigen::LDLT<MatrixXd>(MatrixXd(a)).vectorD().minCoeff();
}

Eigen::MatrixXd solve_square(const MatrixView& a, const MatrixView& b) {
  const MatrixXd square = a, right = b;
  return square.partialPivLu().solve(right);
}

}  // namespace backlash::signal
