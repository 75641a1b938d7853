// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/dynamics.h"

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "backlash_diagnosis/base/error.h"

namespace backlash::arm {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;  // turning above, moving below
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using BodyRegressor = Eigen::Matrix<double, 6, 10>;  // force above, moment below

Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// I w = dot(w) (I_xx, I_xy, I_xz, I_yy, I_yz, I_zz)
Eigen::Matrix<double, 3, 6> dot(const Vector3d& w) {
  Eigen::Matrix<double, 3, 6> m;
  m << w.x(), w.y(), w.z(), 0, 0, 0, 0, w.x(), 0, w.y(), w.z(), 0, 0, 0, w.x(), 0, w.y(), w.z();
  return m;
}

/// Of a link's frame, in that frame: how it turns, and the acceleration of its origin less gravity.
struct Motion {
  Matrix3d rotation;  // into the frame before
  Vector3d w, wd, acceleration;
};

void check_sizes(const Chain& chain, const Joints& values) {
  if (std::size_t(values.size()) != chain.size() || chain.links.size() != chain.size())
    throw InvalidParameter("joints", double(values.size()),
                           "must be as many as the chain has: " + std::to_string(chain.size()));
}

std::vector<Motion> motions(const Chain& chain, const Joints& q, const Joints& v, const Joints& a) {
  check_sizes(chain, q), check_sizes(chain, v), check_sizes(chain, a);
  std::vector<Motion> all(chain.size());
  Vector3d w = Vector3d::Zero(), wd = Vector3d::Zero(), acceleration = -chain.gravity;
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const Joint& joint = chain.joints[i];
    const auto k = Eigen::Index(i);
    Motion& m = all[i];
    m.rotation = joint.rotation * Eigen::AngleAxisd(q[k], joint.axis).toRotationMatrix();
    acceleration += wd.cross(joint.position) + w.cross(w.cross(joint.position));
    const Vector3d carried = m.rotation.transpose() * w;
    m.w = carried + joint.axis * v[k];
    m.wd = m.rotation.transpose() * wd + carried.cross(joint.axis) * v[k] + joint.axis * a[k];
    m.acceleration = m.rotation.transpose() * acceleration;
    w = m.w, wd = m.wd, acceleration = m.acceleration;
  }
  return all;
}

BodyRegressor body_regressor(const Motion& m) {
  BodyRegressor b = BodyRegressor::Zero();
  const Matrix3d turning = cross(m.wd) + cross(m.w) * cross(m.w);
  b.block<3, 1>(0, 0) = m.acceleration;
  b.block<3, 3>(0, 1) = turning;
  b.block<3, 3>(3, 1) = -cross(m.acceleration);
  b.block<3, 6>(3, 4) = dot(m.wd) + cross(m.w) * dot(m.w);
  return b;
}

}  // namespace

Joints inverse_dynamics(const Chain& chain, const Joints& q, const Joints& v, const Joints& a) {
  const std::vector<Motion> all = motions(chain, q, v, a);
  Joints torque(q.size());
  Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();  // on the link behind, in this frame
  for (std::size_t i = chain.size(); i-- > 0;) {
    const Vector6 own = body_regressor(all[i]) * chain.links[i];
    force += own.head<3>();
    moment += own.tail<3>();
    torque[Eigen::Index(i)] = chain.joints[i].axis.dot(moment);
    force = (all[i].rotation * force).eval();
    moment = (all[i].rotation * moment + chain.joints[i].position.cross(force)).eval();
  }
  return torque;
}

Eigen::MatrixXd regressor(const Chain& chain, const Joints& q, const Joints& v, const Joints& a) {
  const std::vector<Motion> all = motions(chain, q, v, a);
  const auto n = Eigen::Index(chain.size());
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(n, 10 * n);
  for (Eigen::Index link = 0; link < n; ++link) {
    BodyRegressor b = body_regressor(all[std::size_t(link)]);
    for (Eigen::Index i = link; i >= 0; --i) {
      const Joint& joint = chain.joints[std::size_t(i)];
      y.block<1, 10>(i, 10 * link) = joint.axis.transpose() * b.bottomRows<3>();
      const Eigen::Matrix<double, 3, 10> force = all[std::size_t(i)].rotation * b.topRows<3>();
      b.bottomRows<3>() =
          (all[std::size_t(i)].rotation * b.bottomRows<3>() + cross(joint.position) * force).eval();
      b.topRows<3>() = force;
    }
  }
  return y;
}

Eigen::MatrixXd gravity_regressor(const Chain& chain, const Joints& q) {
  const Joints rest = Joints::Zero(q.size());
  Chain turned = chain;
  Eigen::MatrixXd y(q.size(), 3);
  for (int axis = 0; axis < 3; ++axis) {
    turned.gravity = Vector3d::Unit(axis);
    y.col(axis) = inverse_dynamics(turned, q, rest, rest);
  }
  return y;
}

namespace {

/// Spatial quantities of one link in its frame.
struct ArticulatedBody {
  Matrix6 transform;  // motion: this frame from the frame before
  Vector6 axis, velocity, bias, force;
  Matrix6 inertia;
  Vector6 u;
  double d = 0, rest = 0;
};

Matrix6 motion_transform(const Matrix3d& rotation, const Vector3d& position) {
  Matrix6 x = Matrix6::Zero();
  const Matrix3d back = rotation.transpose();
  x.topLeftCorner<3, 3>() = back;
  x.bottomRightCorner<3, 3>() = back;
  x.bottomLeftCorner<3, 3>() = -back * cross(position);
  return x;
}

Matrix6 cross_motion(const Vector6& v) {
  Matrix6 x = Matrix6::Zero();
  x.topLeftCorner<3, 3>() = cross(v.head<3>());
  x.bottomRightCorner<3, 3>() = cross(v.head<3>());
  x.bottomLeftCorner<3, 3>() = cross(v.tail<3>());
  return x;
}

Matrix6 spatial_inertia(const BodyParameters& p) {
  Matrix6 m = Matrix6::Zero();
  m.topLeftCorner<3, 3>() << p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9];
  m.topRightCorner<3, 3>() = cross(p.segment<3>(1));
  m.bottomLeftCorner<3, 3>() = -cross(p.segment<3>(1));
  m.bottomRightCorner<3, 3>() = p[0] * Matrix3d::Identity();
  return m;
}

std::vector<ArticulatedBody> moving_bodies(const Chain& chain, const Joints& q, const Joints& v) {
  std::vector<ArticulatedBody> bodies(chain.size());
  Vector6 before = Vector6::Zero();
  for (std::size_t i = 0; i < chain.size(); ++i) {
    ArticulatedBody& b = bodies[i];
    const Joint& joint = chain.joints[i];
    const auto k = Eigen::Index(i);
    b.transform = motion_transform(joint.rotation * Eigen::AngleAxisd(q[k], joint.axis).toRotationMatrix(),
                                   joint.position);
    b.axis << joint.axis, Vector3d::Zero();
    b.velocity = b.transform * before + b.axis * v[k];
    b.bias = cross_motion(b.velocity) * b.axis * v[k];
    b.inertia = spatial_inertia(chain.links[i]);
    b.force = -cross_motion(b.velocity).transpose() * (b.inertia * b.velocity);
    before = b.velocity;
  }
  return bodies;
}

}  // namespace

Joints forward_dynamics(const Chain& chain, const Joints& q, const Joints& v, const Joints& torque,
                        const Joints& rotor_inertia, const Joints& given) {
  check_sizes(chain, q), check_sizes(chain, v), check_sizes(chain, torque);
  if (rotor_inertia.size() > 0) check_sizes(chain, rotor_inertia);
  if (given.size() > 0) check_sizes(chain, given);
  const auto is_given = [&](Eigen::Index k) { return given.size() > 0 && !std::isnan(given[k]); };
  std::vector<ArticulatedBody> bodies = moving_bodies(chain, q, v);
  for (std::size_t i = chain.size(); i-- > 0;) {
    ArticulatedBody& b = bodies[i];
    const auto k = Eigen::Index(i);
    b.u = b.inertia * b.axis;
    b.d = b.axis.dot(b.u) + (rotor_inertia.size() > 0 ? rotor_inertia[k] : 0);
    b.rest = torque[k] - b.axis.dot(b.force);
    if (i == 0) break;
    const Matrix6 left = is_given(k) ? b.inertia : Matrix6(b.inertia - b.u * b.u.transpose() / b.d);
    const Vector6 force = b.force + left * b.bias + b.u * (is_given(k) ? given[k] : b.rest / b.d);
    bodies[i - 1].inertia += b.transform.transpose() * left * b.transform;
    bodies[i - 1].force += b.transform.transpose() * force;
  }
  Joints acceleration(q.size());
  Vector6 before = Vector6::Zero();
  before.tail<3>() = -chain.gravity;
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const ArticulatedBody& b = bodies[i];
    const Vector6 carried = b.transform * before + b.bias;
    const auto k = Eigen::Index(i);
    acceleration[k] = is_given(k) ? given[k] : (b.rest - b.u.dot(carried)) / b.d;
    before = carried + b.axis * acceleration[k];
  }
  return acceleration;
}

double energy(const Chain& chain, const Joints& q, const Joints& v) {
  const std::vector<ArticulatedBody> bodies = moving_bodies(chain, q, v);
  double sum = 0;
  Matrix3d rotation = Matrix3d::Identity();
  Vector3d origin = Vector3d::Zero();
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const Joint& joint = chain.joints[i];
    origin += rotation * joint.position;
    rotation =
        (rotation * joint.rotation * Eigen::AngleAxisd(q[Eigen::Index(i)], joint.axis).toRotationMatrix())
            .eval();
    const BodyParameters& p = chain.links[i];
    sum += 0.5 * bodies[i].velocity.dot(bodies[i].inertia * bodies[i].velocity);
    sum -= chain.gravity.dot(p[0] * origin + rotation * p.segment<3>(1));
  }
  return sum;
}

}  // namespace backlash::arm
