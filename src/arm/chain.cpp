// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/chain.h"

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::arm {

BodyParameters parameters_of(const Body& b) {
  const Eigen::Vector3d h = b.mass * b.centre;
  const Eigen::Matrix3d about_origin =
      b.inertia +
      b.mass * (b.centre.squaredNorm() * Eigen::Matrix3d::Identity() - b.centre * b.centre.transpose());
  BodyParameters p;
  p << b.mass, h, about_origin(0, 0), about_origin(0, 1), about_origin(0, 2), about_origin(1, 1),
      about_origin(1, 2), about_origin(2, 2);
  return p;
}

Body body_of(const BodyParameters& p) {
  Body b;
  b.mass = p[0];
  b.centre = p.segment<3>(1) / p[0];
  Eigen::Matrix3d about_origin;
  about_origin << p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9];
  b.inertia = about_origin - b.mass * (b.centre.squaredNorm() * Eigen::Matrix3d::Identity() -
                                       b.centre * b.centre.transpose());
  return b;
}

Eigen::Matrix4d pseudo_inertia(const BodyParameters& p) {
  Eigen::Matrix3d inertia;
  inertia << p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9];
  Eigen::Matrix4d pseudo;
  pseudo.topLeftCorner<3, 3>() = 0.5 * inertia.trace() * Eigen::Matrix3d::Identity() - inertia;
  pseudo.topRightCorner<3, 1>() = p.segment<3>(1);
  pseudo.bottomLeftCorner<1, 3>() = p.segment<3>(1).transpose();
  pseudo(3, 3) = p[0];
  return pseudo;
}

bool is_consistent(const BodyParameters& p) {
  return signal::symmetric_eigenvalues(Eigen::MatrixXd(pseudo_inertia(p)))[0] > 0;
}

Body moved(const Body& b, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& position) {
  return {b.mass, rotation * b.centre + position, rotation * b.inertia * rotation.transpose()};
}

}  // namespace backlash::arm
