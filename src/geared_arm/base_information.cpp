// SPDX-License-Identifier: BSD-3-Clause
#include "base_information.h"

#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::geared_arm {
namespace {

constexpr std::uint32_t kStream = 1;      // of the seed
constexpr int kDrawsPerColumn = 3;        // choice: thrice as many rows as columns, and more joints
constexpr double kVanishing = 1e-9;       // of the largest column: below it a column is rounding; choice
constexpr double kSmallestShare = 1e-20;  // of eigenvalues: below it they are rounding

double drive_column(arm::DriveTerm term, double v, double a, double friction_speed) {
  switch (term) {
    case arm::DriveTerm::rotor_inertia:
      return a;
    case arm::DriveTerm::coulomb:
      return std::tanh(v / friction_speed);
    case arm::DriveTerm::viscous:
      return v;
    case arm::DriveTerm::quadratic:
      return v * std::fabs(v);
    case arm::DriveTerm::cubic:
      return v * v * v;
    case arm::DriveTerm::offset:
      return 1;
    case arm::DriveTerm::load:
      break;
  }
  return 0;
}

}  // namespace

Eigen::MatrixXd full_regressor(const arm::ArmRig& rig, const arm::Joints& q, const arm::Joints& v,
                               const arm::Joints& a) {
  const Eigen::MatrixXd links = arm::regressor(rig.chain, q, v, a);
  const auto terms = Eigen::Index(rig.terms.size());
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(links.rows(), links.cols() + links.rows() * terms);
  y.leftCols(links.cols()) = links;
  for (Eigen::Index j = 0; j < links.rows(); ++j)
    for (Eigen::Index t = 0; t < terms; ++t)
      y(j, links.cols() + j * terms + t) =
          drive_column(rig.terms[std::size_t(t)], v[j], a[j], rig.friction_speed(std::size_t(j)));
  return y;
}

BaseInformation::BaseInformation(const arm::ArmRig& rig, const std::vector<MotionLimits>& limits,
                                 std::vector<double> noise, std::uint64_t seed)
    : rig_(rig), noise_(std::move(noise)) {
  const auto n = Eigen::Index(limits.size());
  const Eigen::Index columns = n * (10 + Eigen::Index(rig.terms.size())), draws = kDrawsPerColumn * columns;
  Random random(seed, kStream);
  Eigen::MatrixXd y(draws * n, columns);
  for (Eigen::Index i = 0; i < draws; ++i) {
    arm::Joints q(n), v(n), a(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const MotionLimits& l = limits[std::size_t(j)];
      const double moves = l.lower < l.upper ? 1 : 0;
      q[j] = random.uniform(l.lower, l.upper);
      v[j] = moves * random.uniform(-l.speed, l.speed);
      a[j] = moves * random.uniform(-l.acceleration, l.acceleration);
    }
    y.middleRows(i * n, n) = full_regressor(rig, q, v, a);
  }
  const Eigen::VectorXd size = y.colwise().norm().transpose() / std::sqrt(double(draws));
  const double least = kVanishing * size.maxCoeff();
  for (Eigen::Index c = 0; c < columns; ++c) y.col(c) *= size[c] > least ? 1 / size[c] : 0;
  const Eigen::MatrixXd basis = signal::orthonormal_basis(y);
  for (Eigen::Index c = 0; c < columns; ++c)
    if (size[c] > least && basis.col(c).squaredNorm() > 0.5) columns_.push_back(c);
  for (Eigen::Index j = 0; j < n; ++j)
    if (limits[std::size_t(j)].lower < limits[std::size_t(j)].upper) moving_.push_back(j);
  scale_.resize(Eigen::Index(unknowns()));
  Eigen::Index next = 0;
  for (const Eigen::Index c : columns_) scale_[next++] = size[c];
  for (const Eigen::Index j : moving_) scale_[next++] = limits[std::size_t(j)].torque;
}

Eigen::MatrixXd BaseInformation::rows_of(const JointMotions& m, const Eigen::MatrixXd& torque_rate,
                                         Eigen::Index step) const {
  const Eigen::Index n = m.q.cols(), rows = (m.q.rows() + step - 1) / step;
  const auto columns = Eigen::Index(columns_.size());
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(rows * n, Eigen::Index(unknowns()));
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::MatrixXd full =
        full_regressor(rig_, m.q.row(i * step), m.v.row(i * step), m.a.row(i * step));
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index c = 0; c < columns; ++c)
        y(i * n + j, c) = full(j, columns_[std::size_t(c)]) / (noise_[std::size_t(j)] * scale_[c]);
    for (std::size_t k = 0; k < moving_.size(); ++k) {
      const Eigen::Index j = moving_[k], c = columns + Eigen::Index(k);
      y(i * n + j, c) = torque_rate(i * step, j) / (noise_[std::size_t(j)] * scale_[c]);
    }
  }
  return y;
}

MotionInformation BaseInformation::of(const JointMotions& m, const Eigen::MatrixXd& torque_rate,
                                      Eigen::Index step) const {
  const Eigen::MatrixXd information = signal::gram(rows_of(m, torque_rate, step));
  const Eigen::Index columns = information.cols();
  MotionInformation out;
  const Eigen::VectorXd length = information.diagonal().cwiseSqrt();
  if (!(length.minCoeff() > 0)) return {std::numeric_limits<double>::infinity(), -1e3 * double(columns)};
  const Eigen::VectorXd eigenvalues = signal::symmetric_eigenvalues(
      length.cwiseInverse().asDiagonal() * information * length.cwiseInverse().asDiagonal());
  const double largest = eigenvalues[columns - 1];
  for (Eigen::Index c = 0; c < columns; ++c)
    out.log_volume +=
        std::log(length[c]) + 0.5 * std::log(std::fmax(eigenvalues[c], kSmallestShare * largest));
  out.condition =
      eigenvalues[0] > 0 ? std::sqrt(largest / eigenvalues[0]) : std::numeric_limits<double>::infinity();
  return out;
}

}  // namespace backlash::geared_arm
