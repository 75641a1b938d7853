// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::signal {

Eigen::VectorXd symmetric_eigenvalues(const MatrixView& a) {
  const Eigen::MatrixXd matrix = a;
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace backlash::signal
