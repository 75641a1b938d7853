// SPDX-License-Identifier: BSD-3-Clause
// Records of two inertias with a spring and a damper between them, integrated here by Runge and Kutta's
// classical method: an oracle that shares nothing with the package's models and simulation.
#pragma once

#include <array>
#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::test {

struct TwoMassMachine {
  double motor_inertia, load_inertia, stiffness, damping, motor_viscous, load_viscous;
  double motor_coulomb = 0;  // N m
};

/// Row 2a of Table 5.1 of the thesis with the damping and half of the friction of Table 5.2 on either side.
constexpr TwoMassMachine kConfiguration2{8.9, 105.8, 460e3, 483, 12, 9};

using Torque = std::function<double(double t, long sample)>;  // N m; sample: the one begun last

/// `rate` samples/s, four steps per sample: at 41 Hz 0.06 rad per step, 1e-8 of the amplitude a cycle. The
/// load speed and positions are recorded too.
inline record::Record two_mass_record(const TwoMassMachine& m, const Torque& torque, double duration,
                                      double rate = 1000) {
  using State = std::array<double, 4>;  // motor angle, twist, motor speed, load speed
  const auto derivative = [&](const State& x, double u) -> State {
    const double mesh = m.stiffness * x[1] + m.damping * (x[2] - x[3]);
    const double coulomb = m.motor_coulomb * std::tanh(x[2] / 1e-4);
    return {x[2], x[2] - x[3], (u - mesh - m.motor_viscous * x[2] - coulomb) / m.motor_inertia,
            (mesh - m.load_viscous * x[3]) / m.load_inertia};
  };
  const auto moved = [](const State& x, const State& v, double h) {
    return State{x[0] + h * v[0], x[1] + h * v[1], x[2] + h * v[2], x[3] + h * v[3]};
  };
  record::Record record;
  record.name = "two masses";
  State x{};
  const long samples = std::lround(duration * rate);
  constexpr int kSteps = 4;
  const double h = 1 / (rate * kSteps);
  for (long k = 0; k < samples; ++k) {
    const double t0 = double(k) / rate;
    record.time.push_back(t0);
    record.column(record::Channel::motor_torque).push_back(torque(t0, k));
    record.column(record::Channel::motor_position).push_back(x[0]);
    record.column(record::Channel::motor_velocity).push_back(x[2]);
    record.column(record::Channel::load_position).push_back(x[0] - x[1]);
    record.column(record::Channel::load_velocity).push_back(x[3]);
    for (int i = 0; i < kSteps; ++i) {
      const double t = t0 + i * h;
      const double begin = torque(t, k), middle = torque(t + h / 2, k), end = torque(t + h, k);
      const State a = derivative(x, begin), b = derivative(moved(x, a, h / 2), middle),
                  c = derivative(moved(x, b, h / 2), middle), d = derivative(moved(x, c, h), end);
      for (std::size_t j = 0; j < x.size(); ++j) x[j] += h / 6 * (a[j] + 2 * b[j] + 2 * c[j] + d[j]);
    }
  }
  return record;
}

inline void add_noise(std::vector<double>& values, double deviation, unsigned seed) {
  Random random(seed);
  for (double& v : values) v += deviation * random.normal();
}

/// The sensors of Table 3.1: speeds to 0.015 deg/s. Torque to 0.5 N m, seen from the load.
inline record::Record with_noise(record::Record record, unsigned seed) {
  constexpr double kSpeed = 0.015 * M_PI / 180;
  add_noise(record.column(record::Channel::motor_torque), 0.5, 3 * seed);
  add_noise(record.column(record::Channel::motor_velocity), kSpeed, 3 * seed + 1);
  add_noise(record.column(record::Channel::load_velocity), kSpeed, 3 * seed + 2);
  return record;
}

/// Sines of `amplitude` from `first` to `last` [Hz] in steps, `cycles` of each, phase going on.
struct SteppedSine {
  double amplitude = 60, first = 0.25, last = 100, step = 0.25, cycles = 10, bias = 0;

  double duration() const {
    double sum = 0;
    for (double f = first; f < last + step / 2; f += step) sum += cycles / f;
    return sum;
  }
  Torque torque() const {
    return [s = *this, f = first, begin = 0.0](double t, long) mutable {
      while (t >= begin + s.cycles / f && f < s.last) begin += s.cycles / f, f += s.step;
      return s.bias + s.amplitude * std::sin(2 * M_PI * f * (t - begin));
    };
  }
};

/// White torque, new at every sample and held until the next.
inline Torque held_noise(double deviation, long samples, unsigned seed) {
  std::vector<double> values(static_cast<std::size_t>(samples), 0.0);
  add_noise(values, deviation, seed);
  return [values = std::move(values)](double, long k) { return values[static_cast<std::size_t>(k)]; };
}

}  // namespace backlash::test
