// SPDX-License-Identifier: BSD-3-Clause
// Arms drawn at random, and the UR10e's.
#pragma once

#include <Eigen/Geometry>
#include <kdl/chain.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>

#include "backlash_diagnosis/arm/arm_rig.h"
#include "backlash_diagnosis/arm/chain.h"
#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/arm/motion.h"
#include "backlash_diagnosis/base/random.h"
#include "support/data.h"

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

inline KDL::Frame frame(const Eigen::Matrix3d& r, const Eigen::Vector3d& p) {
  return {KDL::Rotation(r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)),
          KDL::Vector(p.x(), p.y(), p.z())};
}

/// KDL's segment is a joint and then a fixed frame; the body is said in the frame behind both.
inline KDL::Chain to_kdl(const arm::Chain& chain) {
  KDL::Chain kdl;
  kdl.addSegment(
      KDL::Segment(KDL::Joint(KDL::Joint::None), frame(chain.joints[0].rotation, chain.joints[0].position)));
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const arm::Body b = arm::body_of(chain.links[i]);
    const Eigen::Vector3d a = chain.joints[i].axis;
    const KDL::Frame to_next = i + 1 < chain.size()
                                   ? frame(chain.joints[i + 1].rotation, chain.joints[i + 1].position)
                                   : KDL::Frame::Identity();
    const KDL::RigidBodyInertia inertia(
        b.mass, KDL::Vector(b.centre.x(), b.centre.y(), b.centre.z()),
        KDL::RotationalInertia(b.inertia(0, 0), b.inertia(1, 1), b.inertia(2, 2), b.inertia(0, 1),
                               b.inertia(0, 2), b.inertia(1, 2)));
    kdl.addSegment(
        KDL::Segment(KDL::Joint(KDL::Vector::Zero(), KDL::Vector(a.x(), a.y(), a.z()), KDL::Joint::RotAxis),
                     to_next, to_next.Inverse() * inertia));
  }
  return kdl;
}

inline KDL::JntArray to_kdl(const arm::Joints& values) {
  KDL::JntArray array(unsigned(values.size()));
  array.data = values;
  return array;
}

/// By KDL.
class Torques {
 public:
  explicit Torques(const arm::Chain& chain)
      : kdl_(to_kdl(chain)),
        solver_(kdl_, KDL::Vector(chain.gravity.x(), chain.gravity.y(), chain.gravity.z())) {}
  arm::Joints operator()(const arm::Joints& q, const arm::Joints& v, const arm::Joints& a) const {
    KDL::JntArray torque{unsigned(q.size())};
    solver_.CartToJnt(to_kdl(q), to_kdl(v), to_kdl(a),
                      KDL::Wrenches(kdl_.getNrOfSegments(), KDL::Wrench::Zero()), torque);
    return torque.data;
  }

 private:
  KDL::Chain kdl_;
  mutable KDL::ChainIdSolver_RNE solver_;
};

/// The drives and links of a machine that a rig file does not know, and its records. Torques are KDL's.
struct Machine {
  arm::ArmRig declared = arm::load_arm_rig(package_file("config/ur10e_arm/ur10e_arm.yaml"));
  arm::Chain chain = declared.chain;
  std::vector<arm::JointDrive> drives = declared.joints;
  double noise = 0.02;      // A, white
  double coloured = 0;      // A, standard deviation of noise of first order, 0.2 s
  double wander = 0;        // - of dry and viscous friction, amplitude over two minutes, each joint by itself
  double jitter = 0;        // s, by which the delay of a joint swings over 7 s
  double cold = 0;          // - by which dry and viscous friction is larger at t = 0, for some 80 s
  arm::JointEffect effect;  // that no rig file knows, of the joint `affected`; no id: none
  std::size_t affected = 0, coupled = 0;
  arm::Joints slip = arm::Joints::Zero(Eigen::Index(declared.joints.size()));  // rad, encoders show more

  /// Links, constants and friction off by some ten percent.
  explicit Machine(std::uint64_t seed) {
    Random random(seed);
    declared.common_error = 0;                      // but in tests of a known weight
    const double scale = random.uniform(0.9, 1.1);  // of all constants
    for (std::size_t j = 0; j < drives.size(); ++j) {
      const double f = random.uniform(0.85, 1.15);
      chain.links[j] *= f;
      drives[j].constant *= scale * random.uniform(0.95, 1.05);
      const double size = j < 3 ? 8 : 2;  // N m
      drives[j].terms = {j < 3 ? 3.0 : 0.4, size * f,    0.6 * size, 0.1 * size,
                         0.05 * size,       0.02 * size, 0.05 * f};
      drives[j].delay = 0.005 * random.uniform(0, 2);
    }
  }

  arm::ArmRecord record(std::uint64_t seed, double duration = 32) const {
    return record(seed, duration, *this, duration);
  }

  /// It is another machine from `since` on [s].
  arm::ArmRecord record(std::uint64_t seed, double duration, const Machine& later, double since) const {
    Random random(seed);
    const auto n = Eigen::Index(drives.size());
    Eigen::MatrixXd amplitude(n, 3), frequency(n, 3), phase(n, 3);
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index i = 0; i < 3; ++i) {
        frequency(j, i) = 2 * M_PI * random.uniform(0.04, 0.3);
        amplitude(j, i) = random.uniform(0.15, 0.35) / frequency(j, i);
        phase(j, i) = random.uniform(0, 2 * M_PI);
      }
    arm::ArmRecord out;
    out.name = "simulated";
    out.joints.resize(drives.size());
    const auto state = [&](double at) {
      arm::Joints q = arm::Joints::Zero(n), v = q, a = q;
      for (Eigen::Index j = 0; j < n; ++j)
        for (Eigen::Index i = 0; i < 3; ++i) {
          const double x = frequency(j, i) * at + phase(j, i);
          q[j] += amplitude(j, i) * std::sin(x);
          v[j] += amplitude(j, i) * frequency(j, i) * std::cos(x);
          a[j] -= amplitude(j, i) * frequency(j, i) * frequency(j, i) * std::sin(x);
        }
      return std::array<arm::Joints, 3>{q, v, a};
    };
    const Torques before(chain), after(later.chain);
    Random rough(seed + 77);
    double dahl = 0;  // friction that builds up, of its end value
    arm::Joints slow = arm::Joints::Zero(n), swing = arm::Joints::Zero(n);
    for (Eigen::Index j = 0; j < n; ++j) swing[j] = rough.uniform(0, 2 * M_PI);
    for (double t = 0; t < duration; t += 0.01) {
      const Machine& machine = t < since ? *this : later;
      const auto now = state(t);
      for (std::size_t j = 0; j < drives.size(); ++j) {
        const arm::JointDrive& drive = machine.drives[j];
        const auto k = Eigen::Index(j);
        const auto earlier = state(t - drive.delay - jitter * std::sin(2 * M_PI * t / 7 + swing[k]));
        slow[k] += 0.05 * (-slow[k]) + std::sqrt(2 * 0.05) * coloured * rough.normal();
        const double rubs =
            1 + cold * std::exp(-t / 80) + wander * std::sin(2 * M_PI * t / 120 + 2 * swing[k]);
        arm::Joints q = earlier[0];
        q -= machine.slip;
        const double load = (t < since ? before : after)(q, earlier[1], earlier[2])[k];
        double more = 0;
        if (j == machine.affected) {
          const auto i = Eigen::Index(machine.coupled);
          const double other = torque(machine.drives[machine.coupled],
                                      (t < since ? before : after)(q, earlier[1], earlier[2])[i],
                                      earlier[1][i], earlier[2][i], 1);
          more = machine.effect_torque(q[k], earlier[1][k], load, other, dahl);
        }
        record::Record& r = out.joints[j];
        r.time.push_back(t);
        r.column(record::Channel::motor_position).push_back(std::round(now[0][k] * 1e4) / 1e4);
        r.column(record::Channel::motor_velocity).push_back(std::round(now[1][k] * 1e4) / 1e4);
        r.column(record::Channel::motor_current)
            .push_back((torque(drive, load, earlier[1][k], earlier[2][k], rubs) + more) / drive.constant +
                       slow[k] + noise * random.normal());
      }
    }
    return out;
  }

 private:
  /// The equations of joint_effect.h; presliding as Dahl's differential equation.
  double effect_torque(double q, double v, double load, double other, double& dahl) const {
    const double size = effect.values[0], shape = effect.shape, sign = std::tanh(v / 0.01);
    if (effect.id == "cogging") return size * std::sin(shape * q + 0.4);
    if (effect.id == "position_dependent_friction") return sign * size * std::sin(shape * q + 0.4);
    if (effect.id == "stribeck") return size * sign * std::exp(-v * v / (shape * shape));
    if (effect.id == "cable") return size * q;  // in no dictionary
    if (effect.id == "eddy_current_brake")
      return 2 * size * v * shape / (v * v + shape * shape);  // new_effect
    if (effect.id == "asymmetric_viscous") return size * std::fabs(v);
    if (effect.id == "transmission_coupling" || effect.id == "motor_torque_gain") return size * other;
    if (effect.id == "load_dependent_friction") return size * sign * std::fabs(load);
    if (effect.id != "presliding") return 0;
    const double end = v > 0 ? 1 : -1;
    dahl = end + (dahl - end) * std::exp(-std::fabs(v) * 0.01 / shape);
    return size * (dahl - sign);
  }

  static double torque(const arm::JointDrive& drive, double load, double v, double a, double friction) {
    const auto& f = drive.terms;
    const double sign = std::tanh(v / 0.01);
    return load + f[0] * a + friction * (f[1] * sign + f[2] * v) + f[3] * v * std::fabs(v) +
           f[4] * v * v * v + f[5] + f[6] * sign * std::fabs(load);
  }
};

}  // namespace backlash::test
