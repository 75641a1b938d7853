// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::test {

/// A servo whose load is led along a sum of sines; everything else follows in closed form. The gap is crossed
/// while the torque between the gears is within +-2 N m.
struct LedServo {
  double gap = 5e-4, gap_wave = 0;  // rad, relative amplitude over the position
  double stiffness = 4e5;           // N m/rad
  double hardening = 0;             // 1/rad^2, torque = stiffness x (1 + hardening x^2)
  double power = 1;      // of the torque, that the deflection goes with; as `stiffness` at `working`
  double working = 200;  // N m
  double motor_inertia = 6, load_inertia = 100;  // kg m^2
  double motor_coulomb = 50, load_coulomb = 10;  // N m
  double motor_viscous = 0;                      // N m s/rad
  double offset = 0, scale = 1;                  // of the load encoder
  double eccentricity = 0;                       // rad, once per 0.5 rad of the load
  double skew = 0;                               // s, of the load encoder
  double chatter = 0;                            // N m, of a drive, alternates from sample to sample
  bool swings = false;                           // the motor is thrown from flank to flank with it
  bool light = false;                            // its way across the gap takes no torque
  double torque_noise = 1, motor_step = 8.7e-7, load_step = 7e-6;
  double duration = 20;
  double there = 0;  // s, of a move to and fro over the same path with rests of half of that; 0: the sines
  double asymmetry = 0;  // of the flanks: relative, how much stiffer the positive one is
  double weight = 0;     // N m, of the load, at 90 degrees from where it rests
  double saturates = 0;  // N m, at which a drive saturates whose command is recorded; 0: none does

  double load(double t) const {
    if (there > 0) {
      const double x = std::fmod(t, 3 * there) / there, part = std::min(1.0, x < 1.5 ? x : x - 1.5);
      const double moved = part - std::sin(2 * M_PI * part) / (2 * M_PI);  // cycloid
      return 0.4 * (x < 1.5 ? moved : 1 - moved);
    }
    return 0.6 * std::sin(2 * M_PI * 0.11 * t) + 0.05 * std::sin(2 * M_PI * 1.3 * t + 1);
  }
  double transmitted(double t) const {
    const double h = 1e-4, speed = (load(t + h) - load(t - h)) / (2 * h);
    const double acceleration = (load(t + h) - 2 * load(t) + load(t - h)) / (h * h);
    return load_inertia * acceleration + load_coulomb * std::tanh(speed / 1e-3) + weight * std::cos(load(t));
  }
  double elastic(double torque) const {
    if (power != 1)
      return std::copysign(working / stiffness * std::pow(std::abs(torque) / working, power), torque);
    double x = torque / (stiffness * (1 + std::copysign(asymmetry, torque)));
    for (int k = 0; hardening > 0 && k < 30; ++k)  // Newton's method, quadratic
      x -= (stiffness * x * (1 + hardening * x * x) - torque) / (stiffness * (1 + 3 * hardening * x * x));
    return x;
  }
  double motor(double t) const {
    const double torque = transmitted(t), q = load(t);
    return q + elastic(torque) + eccentricity * std::sin(2 * M_PI * q / 0.5) +
           0.5 * gap * (1 + gap_wave * std::sin(3 * q)) * std::erf(torque / 1.0);
  }
  record::Record record(double rate = 1000) const {
    record::Record r;
    Random random(3);
    const auto rounded = [](double x, double step) { return step > 0 ? step * std::round(x / step) : x; };
    for (int i = 0; i < duration * rate; ++i) {
      const double t = i / rate, h = 1e-4;
      const auto moved = [&](double at) { return light ? load(at) : motor(at); };
      const double acceleration = (moved(t + h) - 2 * moved(t) + moved(t - h)) / (h * h);
      const double speed = (moved(t + h) - moved(t - h)) / (2 * h);
      const double side = i % 2 == 0 ? 1 : -1;
      const double motor_now = swings ? load(t) + elastic(transmitted(t)) + side * 0.55 * gap : motor(t);
      r.time.push_back(t);
      double torque = transmitted(t) + motor_inertia * acceleration +
                      motor_coulomb * std::tanh(speed / 1e-3) + motor_viscous * speed;
      if (saturates > 0) torque = saturates * std::atanh(torque / saturates);
      r.column(record::Channel::motor_torque)
          .push_back(torque + chatter * side + torque_noise * random.normal());
      r.column(record::Channel::motor_position).push_back(rounded(motor_now, motor_step));
      r.column(record::Channel::load_position).push_back(offset + rounded(scale * load(t - skew), load_step));
    }
    return r;
  }
};

}  // namespace backlash::test
