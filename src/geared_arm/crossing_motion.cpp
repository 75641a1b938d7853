// SPDX-License-Identifier: BSD-3-Clause
#include "crossing_motion.h"

#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/root_in_step.h"

namespace backlash::geared_arm {
namespace {

// Of the usual torque, below which no power is taken: where teeth touch it is what rounding has left, as in
// diagnosis/traverse_motion.cpp.
constexpr double kLeastTorque = 1e-6;
constexpr int kMostChanges = 8;  // of flanks in a step: choice

/// Teeth that are a spring at the usual torque `level` and yield by a power elsewhere; damping is constant
/// for a spring and as the torque after Hertz, as in diagnosis/traverse_motion.cpp.
class Teeth {
 public:
  Teeth(const TraverseJoint& joint, const std::array<double, kCrossingValues>& values, double wider)
      : half_gap_(std::fmax(0, values[kCrossingGap] + wider) / 2),
        stiffness_(joint.stiffness * values[kCrossingStiffness]),
        damping_(joint.damping * values[kCrossingDamping]),
        power_(values[kCrossingPower]),
        level_(joint.level) {}

  /// Beyond the gap, towards the flank of `side`.
  double depth(double twist, double side) const { return side * twist - half_gap_; }

  /// Torque towards the flank, of teeth that are pressed; where they would pull they have come apart. On the
  /// other side of zero deflection it goes on smoothly, for steps that end there.
  double torque(double depth, double rate) const {
    double force = stiffness_ * depth, damping = damping_;
    if (power_ != 1) {
      const double elastic = std::fmax(std::fabs(force) / level_, kLeastTorque);
      const double harder = std::exp((power_ - 1) * std::log(elastic));
      force *= harder, damping *= harder * harder * harder;
    }
    return force + damping * rate;
  }
  double twist_under(double torque) const {
    const double depth = level_ / stiffness_ * std::pow(std::fabs(torque) / level_, 1 / power_);
    return std::copysign(half_gap_ + depth, torque);
  }
  double gap() const { return 2 * half_gap_; }
  /// 1, -1: the flank that is touched; 0: none.
  int flank(double twist) const { return std::fabs(twist) <= half_gap_ ? 0 : twist > 0 ? 1 : -1; }

 private:
  double half_gap_, stiffness_, damping_, power_, level_;
};

/// The hyperbolic tangent, in half the time of the library's.
double saturated(double x) {
  const double size = std::fabs(x);
  return std::copysign(size < 18 ? 1 - 2 / (std::exp(2 * size) + 1) : 1, x);
}

using Small = std::array<double, kMostGaps>;

/// Links and motors between two samples.
class Interval {
 public:
  Interval(const CrossingData& data, const CrossingWindow& window, Eigen::Index i,
           const Eigen::MatrixXd& mobility0, const Eigen::MatrixXd& mobility1)
      : window_(window), i_(i), interval_(data.interval), m0_(mobility0), m1_(mobility1) {}

  void motor(double u, Eigen::Index j, double& q, double& v) const {
    const double q0 = window_.position(i_, j), q1 = window_.position(i_ + 1, j);
    const double v0 = window_.rate(i_, j) * interval_, v1 = window_.rate(i_ + 1, j) * interval_;
    const double u2 = u * u, u3 = u2 * u;
    q = (2 * u3 - 3 * u2 + 1) * q0 + (u3 - 2 * u2 + u) * v0 + (3 * u2 - 2 * u3) * q1 + (u3 - u2) * v1;
    v = ((6 * u2 - 6 * u) * (q0 - q1) + (3 * u2 - 4 * u + 1) * v0 + (3 * u2 - 2 * u) * v1) / interval_;
  }
  double bias(double u, Eigen::Index j) const {
    return (1 - u) * window_.bias(i_, j) + u * window_.bias(i_ + 1, j);
  }
  double mobility(double u, Eigen::Index r, Eigen::Index c) const {
    return (1 - u) * m0_(r, c) + u * m1_(r, c);
  }

 private:
  const CrossingWindow& window_;
  Eigen::Index i_;
  double interval_;
  const Eigen::MatrixXd &m0_, &m1_;
};

/// What the teeth of a joint do at a place: the torque they would have if pressed.
struct Touch {
  double side, depth, rate, torque;  // -, rad, rad/s, N m, towards the flank of `side`
};
using Touches = std::array<Touch, kMostGaps>;

/// Teeth are pressed, or not, from the begin of a step to its end. Where that changes in it, as those that
/// are apart touch or those that are pressed would pull, the step ends there and another goes on from there:
/// damped teeth push at once when they touch, and a step across that would be wrong by as much as it is long.
class Links {
 public:
  Links(const CrossingData& data, const CrossingMachine& machine, const Eigen::VectorXd& own)
      : data_(data), machine_(machine), beta_(own), n_(Eigen::Index(machine.size())) {
    for (std::size_t j = 0; j < machine.size(); ++j)
      teeth_.emplace_back(data.joints[j], machine[j], own[n_ + Eigen::Index(j)]);
  }

  void begin(const CrossingWindow& window) {
    for (Eigen::Index j = 0; j < n_; ++j) {
      const auto k = std::size_t(j);
      const double twist = teeth_[k].twist_under(window.load[j]);
      q_[k] = window.position(0, j) - twist - beta_[2 * n_ + j];
      v_[k] = window.rate(0, j) - beta_[3 * n_ + j];
      pressed_[k] = teeth_[k].flank(twist) != 0;
    }
  }

  /// From u0 to u1 [samples]; adds the mean torque times the step to `sum`.
  void step(const Interval& at, double u0, double u1, Small& sum) {
    for (int changes = 0; u0 < u1; ++changes) {
      const Small q = q_, v = v_;
      Small mean{};
      advance(at, u0, u1, mean);
      const double share = until_change((u1 - u0) * data_.interval);
      double end = u1;
      if (share < 1 && changes < kMostChanges) {
        q_ = q, v_ = v, mean = {}, end = u0 + share * (u1 - u0);
        advance(at, u0, end, mean);
      }
      for (std::size_t j = 0; j < std::size_t(n_); ++j) sum[j] += mean[j];
      for (const std::size_t j : changing_) pressed_[j] = !pressed_[j];
      u0 = end;
    }
  }

  int flank(const CrossingWindow& window, Eigen::Index sample, Eigen::Index j) const {
    return teeth_[std::size_t(j)].flank(window.position(sample, j) - q_[std::size_t(j)]);
  }

 private:
  /// Runge and Kutta's step.
  void advance(const Interval& at, double u0, double u1, Small& sum) {
    const double dt = (u1 - u0) * data_.interval, half = (u0 + u1) / 2;
    Small a1, a2, a3, a4, t1, t2, t3, t4;
    Touches unused;
    rates(at, u0, q_, v_, a1, t1, begin_);
    Small q2 = moved(q_, v_, dt / 2), v2 = moved(v_, a1, dt / 2);
    rates(at, half, q2, v2, a2, t2, unused);
    Small q3 = moved(q_, v2, dt / 2), v3 = moved(v_, a2, dt / 2);
    rates(at, half, q3, v3, a3, t3, middle_);
    Small q4 = moved(q_, v3, dt), v4 = moved(v_, a3, dt);
    rates(at, u1, q4, v4, a4, t4, unused);
    for (std::size_t j = 0; j < std::size_t(n_); ++j) {
      q_[j] += dt * (v_[j] + 2 * v2[j] + 2 * v3[j] + v4[j]) / 6;
      v_[j] += dt * (a1[j] + 2 * a2[j] + 2 * a3[j] + a4[j]) / 6;
      sum[j] += (u1 - u0) * (t1[j] + 2 * t2[j] + 2 * t3[j] + t4[j]) / 6;
    }
    for (std::size_t j = 0; j < std::size_t(n_); ++j) end_[j] = touch(at, u1, j, q_[j], v_[j]);
  }

  Small moved(const Small& from, const Small& rate, double dt) const {
    Small to;
    for (std::size_t j = 0; j < std::size_t(n_); ++j) to[j] = from[j] + dt * rate[j];
    return to;
  }

  Touch touch(const Interval& at, double u, std::size_t j, double q, double v) const {
    double motor, rate;
    at.motor(u, Eigen::Index(j), motor, rate);
    const double side = motor > q ? 1 : -1, depth = teeth_[j].depth(motor - q, side);
    return {side, depth, side * (rate - v),
            pressed_[j] || depth > 0 ? teeth_[j].torque(depth, side * (rate - v)) : 0};
  }

  /// Share of the last step, `dt` long, at which the first joints come to touch or leave, and which these
  /// are; 1 and none: none does.
  double until_change(double dt) {
    changing_.clear();
    double first = 1;
    for (std::size_t j = 0; j < std::size_t(n_); ++j) {
      const Touch &begin = begin_[j], &end = end_[j];
      if (pressed_[j] == (end.depth > 0 && end.torque > 0)) continue;
      const double turn = begin.side * end.side, gap = begin.depth + teeth_[j].gap();
      const double share = pressed_[j]
                               ? signal::root_by_middle(-begin.torque, -middle_[j].torque, -end.torque)
                               : signal::root_by_slopes(turn > 0 ? begin.depth : -gap, end.depth,
                                                        dt * turn * begin.rate, dt * end.rate);
      if (share > first) continue;
      if (share < first) changing_.clear();
      first = share;
      changing_.push_back(j);
    }
    return first;
  }

  void rates(const Interval& at, double u, const Small& q, const Small& v, Small& a, Small& torque,
             Touches& touches) const {
    Small net;
    for (Eigen::Index j = 0; j < n_; ++j) {
      const auto k = std::size_t(j);
      touches[k] = touch(at, u, k, q[k], v[k]);
      torque[k] = pressed_[k] ? touches[k].side * touches[k].torque : 0;
      net[k] = torque[k] - at.bias(u, j) - beta_[j] - data_.joints[k].link_viscous * v[k] -
               machine_[k][kCrossingCoulomb] * saturated(v[k] / data_.friction_speed);
    }
    for (Eigen::Index j = 0; j < n_; ++j) {
      double sum = 0;
      for (Eigen::Index c = 0; c < n_; ++c) sum += at.mobility(u, j, c) * net[std::size_t(c)];
      a[std::size_t(j)] = sum;
    }
  }

  const CrossingData& data_;
  const CrossingMachine& machine_;
  const Eigen::VectorXd& beta_;  // its first entries
  Eigen::Index n_;
  std::vector<Teeth> teeth_;
  Small q_, v_;
  std::array<bool, kMostGaps> pressed_{};
  Touches begin_, middle_, end_;       // of the last step
  std::vector<std::size_t> changing_;  // joints, at its end
};

/// Adds the flights that have ended at a sample.
class Flights {
 public:
  explicit Flights(std::size_t joints) : last_(joints, 0), left_(joints, 0) {}
  void see(std::size_t joint, Eigen::Index sample, int flank, std::vector<Flight>& found) {
    if (flank == 0) return;
    if (last_[joint] == -flank) found.push_back({joint, left_[joint], sample, flank});
    last_[joint] = flank;
    left_[joint] = sample;
  }

 private:
  std::vector<int> last_;
  std::vector<Eigen::Index> left_;
};

}  // namespace

LinkMobilities link_mobilities(const CrossingData& data, const CrossingWindow& window,
                               const CrossingMachine& machine) {
  LinkMobilities all;
  for (Eigen::MatrixXd links : window.inertia) {
    for (std::size_t j = 0; j < machine.size(); ++j)
      links(Eigen::Index(j), Eigen::Index(j)) -= data.joints[j].rotor * (machine[j][kCrossingRotor] - 1);
    all.push_back(signal::symmetric_inverse(links));
  }
  return all;
}

Eigen::MatrixXd mesh_torques(const CrossingData& data, const CrossingWindow& window,
                             const LinkMobilities& mobilities, const CrossingMachine& machine,
                             const Eigen::VectorXd& own, std::vector<Flight>* flights) {
  const auto n = Eigen::Index(machine.size());
  Eigen::MatrixXd mean(window.samples() - 1, n);
  Links links(data, machine, own);
  links.begin(window);
  Flights seen(machine.size());
  for (Eigen::Index i = 0; i + 1 < window.samples(); ++i) {
    const Interval at(data, window, i, mobilities[std::size_t(i)], mobilities[std::size_t(i + 1)]);
    if (flights)
      for (Eigen::Index j = 0; j < n; ++j) seen.see(std::size_t(j), i, links.flank(window, i, j), *flights);
    Small sum{};
    for (int s = 0; s < data.steps; ++s)
      links.step(at, double(s) / data.steps, double(s + 1) / data.steps, sum);
    for (Eigen::Index j = 0; j < n; ++j) mean(i, j) = sum[std::size_t(j)];
  }
  return mean;
}

}  // namespace backlash::geared_arm
