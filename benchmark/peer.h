// SPDX-License-Identifier: BSD-3-Clause
// The rig of config/sarkar_1997.yaml as one would write it by hand for Boost.odeint: the peer of the
// integrators here. Equations of include/backlash_diagnosis/model/gear_train.h, with the numbers of the rig
// that is read.
#pragma once

#include <array>
#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <vector>

#include "backlash_diagnosis/rig_file/rig_file.h"

namespace peer {

using State = std::array<double, 6>;  // motor, pinion, gear: angles, then speeds

struct Equations {
  explicit Equations(const backlash::model::Rig& rig)
      : motor(1 / rig.motor.inertia),
        pinion(1 / rig.pinion.inertia),
        gear(1 / rig.gear.inertia),
        viscous(rig.motor.viscous_damping),
        k_in(rig.input_coupling.stiffness),
        c_in(rig.input_coupling.damping),
        k_out(rig.output_coupling.stiffness),
        c_out(rig.output_coupling.damping),
        radius(rig.mesh.lever()),
        half_gap(0.5 * rig.mesh.backlash),
        stiffness(rig.mesh.contact_spec().values.at("stiffness")),
        loss(1.5 * rig.mesh.contact_spec().values.at("alpha")) {}

  void operator()(const State& s, State& d, double) const {
    const double in = k_in * (s[0] - s[1]) + c_in * (s[3] - s[4]), out = k_out * s[2] + c_out * s[5];
    const double x = radius * (s[1] - s[2]), depth = std::fabs(x) - half_gap;
    double force = 0;
    if (depth > 0) {
      const double rate = std::copysign(radius * (s[4] - s[5]), x * (s[4] - s[5]));
      force = std::copysign(stiffness * depth * std::sqrt(depth) * std::max(0.0, 1 + loss * rate), x);
    }
    d[0] = s[3], d[1] = s[4], d[2] = s[5];
    d[3] = (torque - viscous * s[3] - in) * motor;
    d[4] = (in - radius * force) * pinion;
    d[5] = (radius * force - out) * gear;
  }

  double motor, pinion, gear, viscous, k_in, c_in, k_out, c_out, radius, half_gap, stiffness, loss;
  double torque = 0;
};

/// Sensor torque at `rate` under a square torque, by dopri5 with dense output, started anew at each switch.
inline std::vector<double> sensor_torque(const backlash::rig_file::RigFile& file, double tolerance,
                                         double absolute, double duration, double rate) {
  using namespace boost::numeric::odeint;
  Equations equations(file.rig);
  auto stepper = make_dense_output(absolute, tolerance, runge_kutta_dopri5<State>());
  const double half = 0.5 / file.simulation.excitation.frequency,
               amplitude = file.simulation.excitation.amplitude;
  const long count = std::lround(duration * rate);
  std::vector<double> values;
  State state{};
  for (long k = 0, segment = 0; k < count; ++segment) {
    equations.torque = segment % 2 == 0 ? amplitude : -amplitude;
    const double end = double(segment + 1) * half;
    stepper.initialize(state, double(segment) * half, 1e-5);
    for (double reached = 0; reached < end;) {
      reached = stepper.do_step(equations).second;
      for (; k < count && double(k) / rate < std::min(reached, end) - 1e-12; ++k) {
        State now;
        stepper.calc_state(double(k) / rate, now);
        values.push_back(equations.k_in * (now[0] - now[1]));
      }
    }
    stepper.calc_state(end, state);
  }
  return values;
}

}  // namespace peer
