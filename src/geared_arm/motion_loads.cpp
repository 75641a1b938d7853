// SPDX-License-Identifier: BSD-3-Clause
#include "motion_loads.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/random.h"

namespace backlash::geared_arm {
namespace {

constexpr std::uint32_t kStream = 2;  // of the seed
constexpr int kPoses = 2000;          // drawn; choice (time)
constexpr int kSteps = 400;           // of a search for the largest load, per joint and flank; choice (time)
constexpr double kFinest = M_PI / 180;  // rad: of hidden ranges; choice

/// Motor friction as arm/arm_rig.h has it.
double motor_friction(const arm::ArmRig& rig, std::size_t joint, double v, double chain) {
  return arm::drive_friction(rig.joints[joint], {0, 0, v, std::tanh(v / rig.friction_speed(joint)), chain});
}

/// A pose and how it moves; a: as hard as the limits allow, whichever way helps.
struct Moment {
  arm::Joints q, v;
};

class Reach {
 public:
  Reach(const GearedArm& arm, const arm::Chain& chain, const std::vector<MotionLimits>& limits)
      : arm_(arm), chain_(chain), limits_(limits), rest_(arm::Joints::Zero(Eigen::Index(limits.size()))) {}

  Moment drawn(Random& random) const {
    Moment m{rest_, rest_};
    for (Eigen::Index j = 0; j < rest_.size(); ++j) {
      const MotionLimits& l = limits_[std::size_t(j)];
      m.q[j] = random.uniform(l.lower, l.upper);
      m.v[j] = l.lower < l.upper ? random.uniform(-l.speed, l.speed) : 0;
    }
    return m;
  }

  Moment changed(const Moment& from, double size, Random& random) const {
    Moment m = from;
    for (Eigen::Index j = 0; j < rest_.size(); ++j) {
      const MotionLimits& l = limits_[std::size_t(j)];
      if (!(l.lower < l.upper)) continue;
      const double turn = std::fmin(l.upper - l.lower, M_PI);
      m.q[j] = std::clamp(m.q[j] + size * turn * random.normal(), l.lower, l.upper);
      m.v[j] = std::clamp(m.v[j] + size * l.speed * random.normal(), -l.speed, l.speed);
    }
    return m;
  }

  /// The largest -T and T of each joint, two columns.
  Eigen::MatrixXd loads(const Moment& m) const {
    const Eigen::Index n = rest_.size();
    const arm::Joints steady = arm::inverse_dynamics(chain_, m.q, m.v, rest_);
    const arm::Joints gravity = arm::inverse_dynamics(chain_, m.q, rest_, rest_);
    Eigen::VectorXd inertial = Eigen::VectorXd::Zero(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const MotionLimits& l = limits_[std::size_t(k)];
      if (!(l.lower < l.upper)) continue;
      arm::Joints a = rest_;
      a[k] = l.acceleration;
      inertial += (arm::inverse_dynamics(chain_, m.q, rest_, a) - gravity).cwiseAbs();
    }
    Eigen::MatrixXd out(n, 2);
    for (Eigen::Index j = 0; j < n; ++j) {
      const GearedJoint& joint = arm_.joints[std::size_t(j)];
      const double v = m.v[j];
      const double load = steady[j] + joint.link_viscous * v +
                          joint.link_coulomb * std::tanh(v / arm_.rig.identification.friction_speed);
      out.row(j) << inertial[j] - load, inertial[j] + load;
    }
    return out;
  }

 private:
  const GearedArm& arm_;
  const arm::Chain& chain_;
  const std::vector<MotionLimits>& limits_;
  arm::Joints rest_;
};

}  // namespace

JointMotions sampled_motion(const std::vector<simulation::FourierMotion>& series, double from, double to,
                            double step) {
  constexpr double kSameTime = 1e-9;  // of a step: rounding of the end
  const auto rows = Eigen::Index(std::floor((to - from) / step + kSameTime)) + 1,
             n = Eigen::Index(series.size());
  JointMotions m{Eigen::MatrixXd(rows, n), Eigen::MatrixXd(rows, n), Eigen::MatrixXd(rows, n)};
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const simulation::Kinematics k =
          simulation::kinematics(series[std::size_t(j)], from + step * double(i));
      m.q(i, j) = k.position, m.v(i, j) = k.velocity, m.a(i, j) = k.acceleration;
    }
  return m;
}

MotionTorques torques_of(const GearedArm& arm, const arm::Chain& chain, const JointMotions& m) {
  const Eigen::Index rows = m.q.rows(), n = m.q.cols();
  MotionTorques out{Eigen::MatrixXd(rows, n), Eigen::MatrixXd(rows, n)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const arm::Joints torque = arm::inverse_dynamics(chain, m.q.row(i), m.v.row(i), m.a.row(i));
    for (Eigen::Index j = 0; j < n; ++j) {
      const GearedJoint& joint = arm.joints[std::size_t(j)];
      const double v = m.v(i, j);
      out.mesh(i, j) = torque[j] + joint.link_viscous * v +
                       joint.link_coulomb * std::tanh(v / arm.rig.identification.friction_speed);
      out.motor(i, j) =
          out.mesh(i, j) + motor_friction(arm.rig, std::size_t(j), v, torque[j]) +
          arm.rig.joints[std::size_t(j)].terms[std::size_t(arm::DriveTerm::rotor_inertia)] * m.a(i, j);
    }
  }
  return out;
}

std::vector<std::array<double, 2>> reachable_loads(const GearedArm& arm, const arm::Chain& chain,
                                                   const std::vector<MotionLimits>& limits,
                                                   std::uint64_t seed) {
  const Reach reach(arm, chain, limits);
  Random random(seed, kStream);
  const std::size_t n = limits.size();
  std::vector<std::array<Moment, 2>> best(n);
  std::vector<std::array<double, 2>> largest(n, {-INFINITY, -INFINITY});
  const auto keep = [&](const Moment& moment, std::size_t j, int side, double load) {
    if (!(load > largest[j][std::size_t(side)])) return false;
    largest[j][std::size_t(side)] = load;
    best[j][std::size_t(side)] = moment;
    return true;
  };
  for (int i = 0; i < kPoses; ++i) {
    const Moment moment = reach.drawn(random);
    const Eigen::MatrixXd loads = reach.loads(moment);
    for (std::size_t j = 0; j < n; ++j)
      for (const int side : {0, 1}) keep(moment, j, side, loads(Eigen::Index(j), side));
  }
  for (std::size_t j = 0; j < n; ++j)
    for (const int side : {0, 1}) {
      double size = 0.2;  // of the ranges; grows with success, shrinks without
      for (int i = 0; i < kSteps; ++i) {
        const Moment moment = reach.changed(best[j][std::size_t(side)], size, random);
        size = keep(moment, j, side, reach.loads(moment)(Eigen::Index(j), side)) ? 1.5 * size : 0.95 * size;
      }
    }
  return largest;
}

std::vector<HiddenRange> hidden_ranges(const arm::Chain& chain, const std::vector<MotionLimits>& limits,
                                       const arm::Joints& others, std::size_t joint, double least) {
  const auto j = Eigen::Index(joint);
  const MotionLimits& l = limits[joint];
  // One turn is enough: the one in which the motion lies.
  const bool turns = l.upper - l.lower > 2 * M_PI;
  const double lower = turns ? std::clamp(others[j] - M_PI, l.lower, l.upper - 2 * M_PI) : l.lower;
  const double upper = turns ? lower + 2 * M_PI : l.upper;
  const arm::Joints rest = arm::Joints::Zero(others.size());
  arm::Joints a = rest, q = others;
  a[j] = l.acceleration;
  const auto steps = std::max(1L, std::lround(std::ceil((upper - lower) / kFinest)));
  std::vector<HiddenRange> ranges;
  int last = 0;
  for (long i = 0; i <= steps; ++i) {
    q[j] = lower + (upper - lower) * double(i) / double(steps);
    const double gravity = arm::inverse_dynamics(chain, q, rest, rest)[j];
    const double inertial = arm::inverse_dynamics(chain, q, rest, a)[j] - gravity;
    const bool held = std::fabs(gravity) > least && inertial - std::fabs(gravity) < least;
    const int flank = !held ? 0 : gravity > 0 ? 1 : -1;
    if (flank != 0 && flank == last)
      ranges.back().upper = q[j];
    else if (flank != 0)
      ranges.push_back({q[j], q[j], flank});
    last = flank;
  }
  return ranges;
}

}  // namespace backlash::geared_arm
