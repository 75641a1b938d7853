// SPDX-License-Identifier: BSD-3-Clause
// Two inertias with play between them, integrated by a plain Runge-Kutta scheme that shares nothing with the
// package: the machine that the identification of play and damping is tried on.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::test {

/// Seen from the load. Coulomb friction grows linearly over 1e-3 rad/s either side of standstill.
struct TwoMasses {
  double motor_inertia = 8.4, load_inertia = 40.5;  // kg m^2 (Yumrukcal 2013, Table 5.1, row 1a)
  double stiffness = 355e3, damping = 515;          // N m/rad, N m s/rad
  double motor_coulomb = 80, load_coulomb = 15;     // N m
  double motor_viscous = 0, load_viscous = 0;       // N m s/rad
  std::function<double(double load)> gap = [](double) { return 4.4e-4; };  // rad
  std::function<double(double load)> centre = [](double) { return 0.0; };  // rad, of the gap
  std::function<double(double t, double motor_speed)> motor_torque = [](double, double) { return 0.0; };
  std::function<double(double t)> load_torque = [](double) { return 0.0; };
  bool braked = false;       // the motor stands
  double motor_speed = 0;    // rad/s, at the start, of both
  double load_position = 0;  // rad, at the start; the motor in the middle of the gap
  double start_offset = 0;   // rad, of the motor at the start

  using State = std::array<double, 4>;  // motor, load position; motor, load speed

  double reduced_inertia() const { return motor_inertia * load_inertia / (motor_inertia + load_inertia); }
  double damping_ratio() const { return damping / (2 * std::sqrt(stiffness * reduced_inertia())); }
  double natural_frequency() const { return std::sqrt(stiffness / reduced_inertia()); }

  double mesh_torque(const State& s) const {
    const double x = s[0] - s[1] - centre(s[1]), half = gap(s[1]) / 2, v = s[2] - s[3];
    if (x > half) return std::max(0.0, stiffness * (x - half) + damping * v);  // no adhesion
    if (x < -half) return std::min(0.0, stiffness * (x + half) + damping * v);
    return 0;
  }
  static double dry(double level, double speed) { return level * std::clamp(speed / 1e-3, -1.0, 1.0); }

  State rate(double t, const State& s, double torque) const {
    const double mesh = mesh_torque(s);
    const double motor = torque - mesh - dry(motor_coulomb, s[2]) - motor_viscous * s[2];
    const double load = mesh + load_torque(t) - dry(load_coulomb, s[3]) - load_viscous * s[3];
    if (braked) return {0, s[3], 0, load / load_inertia};
    return {s[2], s[3], motor / motor_inertia, load / load_inertia};
  }

  void step(State& s, double t, double h, double torque) const {
    const auto ahead = [&](const State& k, double by) {
      State to = s;
      for (int i = 0; i < 4; ++i) to[i] += by * k[i];
      return to;
    };
    const State a = rate(t, s, torque), b = rate(t + h / 2, ahead(a, h / 2), torque),
                c = rate(t + h / 2, ahead(b, h / 2), torque), d = rate(t + h, ahead(c, h), torque);
    for (int i = 0; i < 4; ++i) s[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  }
};

/// The sensors of the thesis (Table 3.1): steps of the positions, deviation of the speeds; 0: perfect.
struct TwoMassSensors {
  double motor_step = 0.0055 / 110 * M_PI / 180, load_step = 0.0004 * M_PI / 180;  // rad
  double speed_noise = 0.015 / 2 * M_PI / 180;                                     // rad/s
  double torque_noise = 0.5;                                                       // N m
  double motor_scale = 1;
  unsigned seed = 1;
};

inline record::Record simulate(const TwoMasses& machine, double duration, const TwoMassSensors& sensors = {},
                               double h = 1e-5) {
  record::Record record;
  Random random(sensors.seed);
  const auto rounded = [](double value, double step) {
    return step > 0 ? step * std::round(value / step) : value;
  };
  TwoMasses::State s = {machine.load_position + machine.centre(machine.load_position) + machine.start_offset,
                        machine.load_position, machine.motor_speed, machine.motor_speed};
  const int inner = static_cast<int>(std::lround(1e-3 / h)), samples = static_cast<int>(duration * 1000);
  for (int i = 0; i < samples; ++i) {
    const double t = 1e-3 * i, torque = machine.motor_torque(t, s[2]);  // held over a sample
    record.time.push_back(t);
    record.column(record::Channel::motor_torque).push_back(torque + sensors.torque_noise * random.normal());
    record.column(record::Channel::motor_position)
        .push_back(rounded(sensors.motor_scale * s[0], sensors.motor_step));
    record.column(record::Channel::load_position).push_back(rounded(s[1], sensors.load_step));
    record.column(record::Channel::motor_velocity).push_back(s[2] + sensors.speed_noise * random.normal());
    record.column(record::Channel::load_velocity).push_back(s[3] + sensors.speed_noise * random.normal());
    for (int k = 0; k < inner; ++k) machine.step(s, t + k * h, h, torque);
  }
  return record;
}

}  // namespace backlash::test
