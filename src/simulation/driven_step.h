// SPDX-License-Identifier: BSD-3-Clause
// One sample of a load that follows the recorded motor, for one load (Real = double) and for several side by
// side (lanes, whose header stands before this one).
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "backlash_diagnosis/model/equations_of_motion.h"
#include "one_lane.h"
#include "power_teeth.h"

namespace backlash::simulation {

/// A sampled signal between two of its samples, u = 0 .. 1: cubic with the slopes [per sample] at its ends.
struct Cubic {
  double y0, y1, d0, d1;

  double operator()(double u) const {
    const double s = 1 - u;
    return s * s * ((1 + 2 * u) * y0 + u * d0) + u * u * ((3 - 2 * u) * y1 - s * d1);
  }
  /// Per sample.
  double slope(double u) const {
    const double s = 1 - u;
    return 6 * u * s * (y1 - y0) + s * (1 - 3 * u) * d0 - u * (2 - 3 * u) * d1;
  }
};

/// After sample k, with slopes from the samples beside it (Catmull and Rom): a straight line would lose 0.03
/// % of a speed at a hundredth of the sampling rate, which next to the feedback is no longer small.
BACKLASH_LANES Cubic between(const std::vector<double>& y, std::size_t k) {
  const std::size_t last = y.size() - 1, j = std::min(k + 1, last);
  const auto slope = [&](std::size_t i) {
    return i == 0 || i == last ? y[j] - y[k] : 0.5 * (y[i + 1] - y[i - 1]);
  };
  return {y[k], y[j], slope(k), slope(j)};
}

/// What is recorded at one moment.
struct Moment {
  double time;
  double motor, motor_rate, load_rate;
};

/// Motion within one sample. The motor's speed is the derivative of its position, so that a damper between
/// the teeth takes the energy that belongs to their motion: another line through the same speeds makes the
/// motor's inertia 0.15 % and the damping 0.1 % too small.
struct Segment {
  Cubic motor, load_rate;
  double start, interval;

  Moment at(double u) const {
    const double t = start + u * interval;
    if (u == 0) return {t, motor.y0, motor.d0 / interval, load_rate.y0};
    if (u == 1) return {t, motor.y1, motor.d1 / interval, load_rate.y1};
    return {t, motor(u), motor.slope(u) / interval, load_rate(u)};
  }
};

/// Integrals over one sample with the weights 1 - u and u.
template <typename Real>
struct alignas(sizeof(Real)) Halves {
  Real early = {}, late = {};

  /// Adds a piece from u0 to u1 by Simpson's rule.
  BACKLASH_LANES void add(double u0, double u1, const Real& f0, const Real& middle, const Real& f1) {
    const double d = (u1 - u0) / 6, um = 0.5 * (u0 + u1);
    early += d * ((1 - u0) * f0 + 4 * (1 - um) * middle + (1 - u1) * f1);
    late += d * (u0 * f0 + 4 * um * middle + u1 * f1);
  }
};

constexpr model::TrainLayout kFollowing = model::TrainLayout::following_load();
constexpr int kParts = model::TrainParts::kPartCount;

/// What acts on a load with dampers, teeth without memory or shape, and friction that does not change
/// (GearTrain::plain_load()): GearTrain::load_forces() without a call, as a sample takes five of them.
template <typename Real>
struct alignas(sizeof(Real)) PlainLoad {
  model::EquationsOfMotion<Real> train;
  PowerTeeth<Real> teeth;
  Real inertia, drawn;  // kg m^2; N m s/rad, with the difference to the recorded speed

  struct alignas(sizeof(Real)) Forces {
    Real net, mesh_torque;  // N m, without dry friction
  };

  /// N m, through the teeth with the gear there.
  BACKLASH_LANES Real mesh_torque(const Moment& m, const Real& position, const Real& rate) const {
    const typename model::EquationsOfMotion<Real>::PartMotion s = moving(m, position, rate);
    return train.lever * teeth.force(train.gap_position(s, teeth.half_gap), train.gap_rate(s));
  }

  /// N m, of the teeth, of dampers and of what draws the load.
  BACKLASH_LANES Real net(const Moment& m, const Real& rate, const Real& mesh_torque) const {
    const Real none = {};
    Real net[kParts];
    const auto mesh = [&](Real * torque) __attribute__((always_inline)) {
      train.add_mesh(mesh_torque, torque);
    };
    train.net_torques(kFollowing, moving(m, none, rate), none, none, mesh, net);
    return net[kFollowing.node[model::TrainParts::kLink]] + drawn * (m.load_rate - rate);
  }

  BACKLASH_LANES Forces forces(const Moment& m, const Real& position, const Real& rate) const {
    const Real torque = mesh_torque(m, position, rate);
    return {net(m, rate, torque), torque};
  }

 private:
  static BACKLASH_LANES typename model::EquationsOfMotion<Real>::PartMotion moving(const Moment& m,
                                                                                   const Real& position,
                                                                                   const Real& rate) {
    const Real motor = Real{} + m.motor, motor_rate = Real{} + m.motor_rate;
    return {{motor, motor, position, position}, {motor_rate, motor_rate, rate, rate}};
  }
};

/// Classical Runge-Kutta over h [s]: moves position and rate, `a1` the acceleration there.
/// `acceleration(stage, position, rate)` is asked for halfway (stages 0 and 1) and at the end (2).
template <typename Real, typename Acceleration>
BACKLASH_LANES void runge_kutta(double h, const Real& a1, const Acceleration& acceleration, Real& q,
                                Real& w) {
  const Real w2 = w + 0.5 * h * a1;
  const Real a2 = acceleration(0, q + 0.5 * h * w, w2), w3 = w + 0.5 * h * a2;
  const Real a3 = acceleration(1, q + 0.5 * h * w2, w3), w4 = w + h * a3;
  const Real a4 = acceleration(2, q + h * w3, w4);
  q += h / 6 * (w + 2 * w2 + 2 * w3 + w4);
  w += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
}

}  // namespace backlash::simulation
