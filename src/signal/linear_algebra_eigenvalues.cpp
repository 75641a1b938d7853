// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::signal {

Eigen::VectorXd symmetric_eigenvalues(const MatrixView& a) {
  const Eigen::MatrixXd matrix = a;
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

SymmetricEigen symmetric_eigen(const MatrixView& a) {
  const Eigen::MatrixXd matrix = a;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace backlash::signal
