// SPDX-License-Identifier: BSD-3-Clause
// A rig with a torque sensor and a locked output whose teeth, sensors and torque are not those of a rig file.
// Shares nothing with the package that is tested:
//   Jm qm'' = tau - cm qm' - Fc sgn(qm') - A sin(n qm + p) - T          T = Ki (qm - qp) + Ci (qm' - qp')
//   Jp qp'' = T - F rb - Fp sgn(qp')
//   Jg qg'' = F rb - Ko qg - Co qg'                                     d = rb |qp - qg| - b / 2
//   F = K d^1.5 max(0, 1 + 3/2 alpha d' + h tanh(d' / 1 mm/s))
// The torque follows what is asked with a lag; the sensor shows T late, by a first-order lag, with some of a
// resonator (a bending shaft) that T shakes, y'' = w^2 (T - y) - 2 z w y'.
#pragma once

#include <string>
#include <vector>

#include "../machines/random.h"

namespace torque_rigs {

using machines::Random;

/// What a rig file declares, and what is true. SI units.
struct Values {
  double motor_inertia, pinion_inertia, gear_inertia, motor_damping, sensor_stiffness, sensor_damping,
      output_stiffness, output_damping, contact, loss;
};

struct Machine {
  Values declared, real;
  double backlash = 0, radius = 0.015;  // m
  // What the rig file has not.
  double hysteresis = 0, cogging = 0, cogging_order = 0, cogging_phase = 0, friction = 0, pinion_friction = 0;
  double drive_gain = 1, drive_offset = 0, drive_lag = 0, drive_noise = 0;  // of motor_torque
  double sensor_gain = 1, sensor_offset = 0, sensor_lag = 0, sensor_noise = 0;
  double bending = 0, bending_frequency = 150, bending_damping = 0.02;
  double resolution = 1e-6;           // rad, of motor_position
  double jitter = 0, lost = 0;        // of an interval, of the samples
  double rate = 2000, level = 0.045;  // Hz, N m
};

/// `effects`: with what the rig file has not, else its values are off alone.
Machine draw_machine(Random& random, bool effects);

struct Row {
  double time, torque, position, sensor;
};

/// `kind`: square, sine, binary or multi.
std::vector<Row> run(const Machine& machine, const std::string& kind, double duration, Random& random);

}  // namespace torque_rigs
