// SPDX-License-Identifier: BSD-3-Clause
// Oracles: KDL's solvers, energy, finite differences.
#include <gtest/gtest.h>

#include <kdl/chaindynparam.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>

#include "arm_machines.h"
#include "backlash_diagnosis/arm/dynamics.h"

namespace backlash::arm {
namespace {

using test::to_kdl;

TEST(Dynamics, InverseDynamicsIsKdls) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Chain chain = test::random_chain(random, 1 + random.below(8));
    const auto n = Eigen::Index(chain.size());
    const Joints q = test::random_joints(random, n, 3), v = test::random_joints(random, n, 3),
                 a = test::random_joints(random, n, 10);
    const KDL::Chain kdl = to_kdl(chain);
    KDL::ChainIdSolver_RNE solver(kdl, KDL::Vector(chain.gravity.x(), chain.gravity.y(), chain.gravity.z()));
    KDL::JntArray torque{unsigned(n)};
    solver.CartToJnt(to_kdl(q), to_kdl(v), to_kdl(a),
                     KDL::Wrenches(kdl.getNrOfSegments(), KDL::Wrench::Zero()), torque);
    const Joints own = inverse_dynamics(chain, q, v, a);
    EXPECT_LT((own - torque.data).norm(), 1e-9 * (1 + own.norm())) << trial;
  }
}

TEST(Dynamics, TorqueIsLinearInTheParametersOfTheLinks) {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    const Chain chain = test::random_chain(random, 1 + random.below(8));
    const auto n = Eigen::Index(chain.size());
    const Joints q = test::random_joints(random, n, 3), v = test::random_joints(random, n, 3),
                 a = test::random_joints(random, n, 10);
    Eigen::VectorXd theta(10 * n);
    for (Eigen::Index i = 0; i < n; ++i) theta.segment<10>(10 * i) = chain.links[std::size_t(i)];
    const Joints own = inverse_dynamics(chain, q, v, a);
    EXPECT_LT((regressor(chain, q, v, a) * theta - own).norm(), 1e-10 * (1 + own.norm()));
    const Joints rest = Joints::Zero(n);
    EXPECT_LT((gravity_regressor(chain, q) * chain.gravity - inverse_dynamics(chain, q, rest, rest)).norm(),
              1e-10 * (1 + own.norm()));
  }
}

TEST(Dynamics, ForwardDynamicsIsKdlsAndTheInverseOfInverseDynamics) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const Chain chain = test::random_chain(random, 1 + random.below(8));
    const auto n = Eigen::Index(chain.size());
    const Joints q = test::random_joints(random, n, 3), v = test::random_joints(random, n, 3),
                 torque = test::random_joints(random, n, 30);
    const Joints rotor = test::random_joints(random, n, 1).cwiseAbs();
    const Joints a = forward_dynamics(chain, q, v, torque, rotor);
    const Joints back = inverse_dynamics(chain, q, v, a) + rotor.cwiseProduct(a);
    EXPECT_LT((back - torque).norm(), 1e-9 * (1 + torque.norm() + a.norm())) << trial;
    const KDL::Chain kdl = to_kdl(chain);  // is referred to
    KDL::ChainDynParam parameters(kdl, KDL::Vector(chain.gravity.x(), chain.gravity.y(), chain.gravity.z()));
    KDL::JntSpaceInertiaMatrix mass{unsigned(n)};
    KDL::JntArray coriolis{unsigned(n)}, gravity{unsigned(n)};
    parameters.JntToMass(to_kdl(q), mass);
    parameters.JntToCoriolis(to_kdl(q), to_kdl(v), coriolis);
    parameters.JntToGravity(to_kdl(q), gravity);
    const Eigen::MatrixXd m = mass.data + Eigen::MatrixXd(rotor.asDiagonal());
    EXPECT_LT((m * a + coriolis.data + gravity.data - torque).norm(),
              1e-9 * (1 + torque.norm() + m.norm() * a.norm()));
  }
}

// Theory: without torque nothing is lost; classical Runge-Kutta of 1/20000 s loses less than 1e-8 of 100 J.
TEST(Dynamics, AFreeChainKeepsItsEnergy) {
  Random random(4);
  const Chain chain = test::random_chain(random, 4);
  const Joints none = Joints::Zero(4);
  Joints q = test::random_joints(random, 4, 2), v = test::random_joints(random, 4, 1);
  const double before = energy(chain, q, v), h = 5e-5;
  const auto rate = [&](const Joints& x, const Joints& w) { return forward_dynamics(chain, x, w, none); };
  for (int k = 0; k < 20000; ++k) {
    const Joints a1 = rate(q, v), v2 = v + h / 2 * a1, a2 = rate(q + h / 2 * v, v2), v3 = v + h / 2 * a2,
                 a3 = rate(q + h / 2 * v2, v3), v4 = v + h * a3, a4 = rate(q + h * v3, v4);
    q += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  EXPECT_NEAR(energy(chain, q, v), before, 1e-6 * (1 + std::fabs(before)));
}

}  // namespace
}  // namespace backlash::arm
