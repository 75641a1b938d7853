// SPDX-License-Identifier: BSD-3-Clause
// Dense linear algebra of small systems. Decompositions and products of matrices are long templates: they are
// compiled once, here, and not in every file that solves a few equations. Include this and not <Eigen/QR> and
// the like. Products of a matrix and a vector are short and may be written as usual.
#pragma once

#include <Eigen/Core>

namespace backlash::signal {

/// Any matrix or vector of double, without a copy where it is stored as one.
using MatrixView = Eigen::Ref<const Eigen::MatrixXd>;

/// A B
Eigen::MatrixXd product(const MatrixView& a, const MatrixView& b);

/// A^T B
Eigen::MatrixXd transposed_product(const MatrixView& a, const MatrixView& b);

/// A^T A
Eigen::MatrixXd gram(const MatrixView& a);

/// X of A X = B for a symmetric positive (semi)definite A, by A = P^T L D L^T P. `b` may be a vector. Only
/// the lower triangle of A is read. Directions in which A is 0 get 0.
Eigen::MatrixXd solve_symmetric(const MatrixView& a, const MatrixView& b);

/// Inverse of a symmetric positive definite matrix, from the same decomposition.
Eigen::MatrixXd symmetric_inverse(const MatrixView& a);

/// Smallest element of D in A = P^T L D L^T P: <= 0, or small beside the diagonal of A, where A is not
/// positive definite.
double smallest_pivot(const MatrixView& a);

/// X of A X = B for a regular square A, by LU decomposition with row pivots. `b` may be a vector.
Eigen::MatrixXd solve_square(const MatrixView& a, const MatrixView& b);

/// Minimises |b - A x|.
struct QrSolution {
  Eigen::VectorXd x;
  /// Smallest over largest diagonal element of R, 0 to 1: about one over the condition of A.
  double diagonal_ratio = 0;
};

/// By Householder's QR decomposition with column pivots. Columns that depend on others get 0. At least as
/// many rows as columns.
QrSolution solve_least_squares(const MatrixView& a, const Eigen::Ref<const Eigen::VectorXd>& b);

/// Orthonormal columns that span those of A, by Gram and Schmidt's process done twice: what a fit of A leaves
/// of v is v - Q (Q^T v). A column that depends on those before it gives zeros.
Eigen::MatrixXd orthonormal_basis(const MatrixView& a);

/// Eigenvalues of a symmetric matrix, in increasing order. Only the lower triangle is read.
Eigen::VectorXd symmetric_eigenvalues(const MatrixView& a);

struct SymmetricEigen {
  Eigen::VectorXd values;   // in increasing order
  Eigen::MatrixXd vectors;  // columns, orthonormal
};

/// A = V diag(values) V^T. Only the lower triangle is read.
SymmetricEigen symmetric_eigen(const MatrixView& a);

}  // namespace backlash::signal
