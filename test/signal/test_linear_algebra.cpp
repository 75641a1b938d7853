// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::signal {
namespace {

Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index columns, std::initializer_list<double> values) {
  Eigen::MatrixXd m(rows, columns);
  auto value = values.begin();
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index k = 0; k < columns; ++k) m(i, k) = *value++;
  return m;
}

double distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() ? (a - b).cwiseAbs().maxCoeff() : INFINITY;
}

const Eigen::MatrixXd kTall = matrix(3, 2, {1, 2, 3, 4, 5, 6});

TEST(LinearAlgebra, ProductsByHand) {
  const Eigen::MatrixXd right = matrix(2, 2, {1, -1, 0, 2});
  EXPECT_EQ(distance(product(kTall, right), matrix(3, 2, {1, 3, 3, 5, 5, 7})), 0);
  EXPECT_EQ(distance(gram(kTall), matrix(2, 2, {35, 44, 44, 56})), 0);
  EXPECT_EQ(distance(transposed_product(kTall, matrix(3, 1, {1, 0, -1})), matrix(2, 1, {-4, -4})), 0);
}

TEST(LinearAlgebra, ProductTakesPartsOfAMatrix) {
  EXPECT_EQ(distance(gram(kTall.topRows(2)), matrix(2, 2, {10, 14, 14, 20})), 0);
  EXPECT_EQ(distance(gram(kTall.row(2).transpose()), matrix(1, 1, {61})), 0);
}

// Hilbert's matrix of order 3 has an inverse of whole numbers.
const Eigen::MatrixXd kHilbert =
    matrix(3, 3, {1, 1. / 2, 1. / 3, 1. / 2, 1. / 3, 1. / 4, 1. / 3, 1. / 4, 1. / 5});
const Eigen::MatrixXd kHilbertInverse = matrix(3, 3, {9, -36, 30, -36, 192, -180, 30, -180, 180});

TEST(LinearAlgebra, SolvesHilbertsEquations) {
  EXPECT_LT(distance(symmetric_inverse(kHilbert), kHilbertInverse), 1e-10);
  const Eigen::VectorXd right = matrix(3, 1, {1, 0, 0});
  EXPECT_LT(distance(solve_symmetric(kHilbert, right), kHilbertInverse.col(0)), 1e-10);
  EXPECT_LT(distance(solve_square(kHilbert, right), kHilbertInverse.col(0)), 1e-10);
}

TEST(LinearAlgebra, OnlyTheLowerTriangleOfASymmetricMatrixIsRead) {
  const Eigen::MatrixXd a = matrix(2, 2, {4, NAN, 2, 3});  // det 8
  EXPECT_LT(distance(symmetric_inverse(a), matrix(2, 2, {3. / 8, -2. / 8, -2. / 8, 4. / 8})), 1e-15);
}

TEST(LinearAlgebra, SolvesASquareThatIsNotSymmetricAndNeedsAPivot) {
  const Eigen::VectorXd x = solve_square(matrix(2, 2, {0, 2, 3, 1}), matrix(2, 1, {4, 5}));
  EXPECT_LT(distance(x, matrix(2, 1, {1, 2})), 1e-15);
}

TEST(LinearAlgebra, SmallestPivotShowsADirectionThatIsNotHeld) {
  // diag 4, then 3 - 2^2 / 4 = 2
  EXPECT_NEAR(smallest_pivot(matrix(2, 2, {4, 2, 2, 3})), 2, 1e-15);
  EXPECT_NEAR(smallest_pivot(matrix(2, 2, {1, 1, 1, 1})), 0, 1e-15);
  EXPECT_LT(smallest_pivot(matrix(2, 2, {1, 2, 2, 1})), -1);
}

TEST(LinearAlgebra, LeastSquaresOfALineByHand) {
  // y = 1, 2, 2 at x = 0, 1, 2: slope 1/2, offset 7/6.
  const Eigen::VectorXd y = matrix(3, 1, {1, 2, 2});
  const QrSolution line = solve_least_squares(matrix(3, 2, {1, 0, 1, 1, 1, 2}), y);
  EXPECT_NEAR(line.x[0], 7.0 / 6, 1e-14);
  EXPECT_NEAR(line.x[1], 0.5, 1e-14);
}

TEST(LinearAlgebra, DiagonalRatioIsThatOfOrthogonalColumnsAndZeroOfDependentOnes) {
  const Eigen::VectorXd y = matrix(3, 1, {1, 2, 2});
  EXPECT_NEAR(solve_least_squares(matrix(3, 2, {0, 100, 3, 0, 4, 0}), y).diagonal_ratio, 0.05, 1e-15);
  EXPECT_LT(solve_least_squares(matrix(3, 2, {1, 2, 2, 4, 3, 6}), y).diagonal_ratio, 1e-15);
  EXPECT_EQ(solve_least_squares(Eigen::MatrixXd::Zero(3, 2), y).diagonal_ratio, 0);
}

TEST(LinearAlgebra, BasisIsOrthonormalAndSpansNearlyDependentColumns) {
  Eigen::MatrixXd a(50, 4);  // powers of x about 100: condition 1e9
  for (int i = 0; i < 50; ++i)
    for (int k = 0; k < 4; ++k) a(i, k) = std::pow(1 + 0.001 * i, k);
  const Eigen::MatrixXd q = orthonormal_basis(a);
  EXPECT_LT(distance(gram(q), Eigen::MatrixXd::Identity(4, 4)), 1e-14);
  EXPECT_LT(distance(product(q, transposed_product(q, a)), a), 1e-13);
}

TEST(LinearAlgebra, BasisHasZerosForADependentColumn) {
  const Eigen::MatrixXd q = orthonormal_basis(matrix(3, 2, {1, 2, 2, 4, 2, 4}));
  EXPECT_LT(distance(q, matrix(3, 2, {1. / 3, 0, 2. / 3, 0, 2. / 3, 0})), 1e-15);
}

TEST(LinearAlgebra, EigenvaluesOfAChainOfMasses) {
  // Second differences of n points: 2 - 2 cos(k pi / (n + 1)), k = 1 ... n.
  constexpr int n = 6;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    a(i, i) = 2;
    if (i > 0) a(i, i - 1) = a(i - 1, i) = -1;
  }
  const Eigen::VectorXd values = symmetric_eigenvalues(a);
  for (int k = 1; k <= n; ++k) EXPECT_NEAR(values[k - 1], 2 - 2 * std::cos(k * M_PI / (n + 1)), 1e-14) << k;
  const SymmetricEigen parts = symmetric_eigen(a);
  EXPECT_LT(distance(parts.values, values), 1e-14);
  EXPECT_LT(distance(parts.vectors * parts.values.asDiagonal() * parts.vectors.transpose(), a), 1e-14);
}

}  // namespace
}  // namespace backlash::signal
