// SPDX-License-Identifier: BSD-3-Clause
// Arms drawn at random, and the UR5's.
#pragma once

#include <Eigen/Geometry>

#include "backlash_diagnosis/arm/chain.h"
#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/base/random.h"

namespace backlash::test {

inline Eigen::Vector3d random_vector(Random& random, double size) {
  return size * Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
}

inline arm::Joints random_joints(Random& random, Eigen::Index n, double size) {
  arm::Joints values(n);
  for (Eigen::Index i = 0; i < n; ++i) values[i] = random.uniform(-size, size);
  return values;
}

inline Eigen::Matrix3d random_rotation(Random& random) {
  return Eigen::AngleAxisd(random.uniform(-3, 3), random_vector(random, 1).normalized()).toRotationMatrix();
}

/// A cloud of five masses: consistent by construction.
inline arm::BodyParameters random_body(Random& random) {
  arm::BodyParameters sum = arm::BodyParameters::Zero();
  for (int i = 0; i < 5; ++i) {
    arm::Body point;
    point.mass = random.uniform(0.1, 2);
    point.centre = random_vector(random, 0.3);
    sum += arm::parameters_of(point);
  }
  return sum;
}

inline arm::Chain random_chain(Random& random, std::size_t joints) {
  arm::Chain chain;
  chain.gravity = random_vector(random, 10);
  for (std::size_t i = 0; i < joints; ++i) {
    chain.joints.push_back({"joint" + std::to_string(i), "link" + std::to_string(i), random_rotation(random),
                            random_vector(random, 0.5), random_vector(random, 1).normalized()});
    chain.links.push_back(random_body(random));
  }
  return chain;
}

}  // namespace backlash::test
