// SPDX-License-Identifier: BSD-3-Clause
// A two-inertia geared servo, and everything that may be odd about it. All at the load side of the reduction:
//   J_M w_M' = tau - friction_M - cogging - T
//   J_L w_L' = T - friction_L - gravity
// A strength of 0 means that the machine does not have the effect. SI units.
#pragma once

#include <cmath>
#include <vector>

namespace machines {

/// amplitude * sin(order * q + phase)
struct Wave {
  double amplitude = 0, order = 0, phase = 0;
  double value(double q) const { return amplitude == 0 ? 0 : amplitude * std::sin(order * q + phase); }
  double slope(double q) const {
    return amplitude == 0 ? 0 : amplitude * order * std::cos(order * q + phase);
  }
};

/// height * exp(-((q - centre) / width)^2)
struct Bump {
  double height = 0, centre = 0, width = 1;
  double value(double q) const {
    const double x = (q - centre) / width;
    return height == 0 || std::abs(x) > 6 ? 0 : height * std::exp(-x * x);
  }
  double slope(double q) const { return -2 * (q - centre) / (width * width) * value(q); }
};

struct Friction {
  double coulomb = 0, viscous = 0;
  double asymmetric_coulomb = 0;  // N m, more forward, less backward
  double asymmetric_viscous = 0;  // N m s/rad, more forward
  double stribeck = 0;            // N m, more at low speed
  double stribeck_speed = 1;      // rad/s
  double quadratic = 0;           // N m s^2/rad^2
  double square_root = 0;         // N m s^0.5/rad^0.5
  double load_dependent = 0;      // -, times the torque through the mesh
  Wave position;                  // relative to coulomb
  double drift = 0;               // 1/s, relative to coulomb
  double bristle_length = 0;      // rad, over which friction builds up (Dahl, LuGre); 0: at once
  double bristle_damping = 0;     // N m s/rad, sigma_1 of LuGre
};

struct Body {
  double inertia = 0;
  Friction friction;
};

struct Mesh {
  double stiffness = 0, damping = 0, backlash = 0;
  bool hertz = false;           // T = K p^1.5 (1 + chi p'), as stiff and damped as declared at working_torque
  double working_torque = 300;  // N m
  double hardening = 0;         // 1/rad^2, T = k p (1 + hardening p^2)
  Wave transmission_error;      // rad
  std::vector<Wave> gap;        // relative to backlash
  Bump gap_fault;               // rad, of backlash
  double ratio_per_torque = 0;  // 1/(N m), motor angle times (1 + . T)
  double creep_per_torque = 0;  // 1/(N m), the output falls back by . T per angle turned
  double thermal_growth = 0;    // relative to backlash
  double thermal_time = 1;      // s
  double slip_torque = 0;       // N m, that the coupling behind the mesh holds; 0: all
  double slip_damping = 1;      // N m s/rad
  // A damaged tooth: the forward flank alone is worn in a triangle and softer there.
  double damage_depth = 0, damage_centre = 0, damage_width = 1;  // rad
  double damage_softening = 0;                                   // share of the stiffness lost in the middle
};

/// A second mesh in series with the first, and the wheel between them; both meshes then have twice the
/// stiffness and damping.
struct SecondStage {
  double backlash = 0;  // rad; 0: there is none
  Body wheel;
};

struct Drive {
  double gain = 1;        // -, times the usual gain of the speed loop
  double saturation = 0;  // N m, the torque that the motor cannot exceed; 0: none
  Wave cogging;           // N m
  Wave speed_ripple;      // N m s^2/rad^2, times the speed squared
};

struct Gravity {
  double amplitude = 0, phase = 0;
};

struct Sensors {
  double motor_resolution = 8.7e-7, load_resolution = 7e-6;  // rad
  double torque_noise = 2;                                   // N m, standard deviation
  double load_gain = 1;                                      // shown over true
  double latency = 0;                                        // s, angles are older than their stamp
  double load_skew = 0;     // s >= 0, so much older still is that of the load
  double noise_corner = 0;  // Hz, above which the noise of the torque falls; 0: white
};

struct Machine {
  Body motor, load;
  Mesh mesh;
  SecondStage second;
  Drive drive;
  Gravity gravity;
  Sensors sensors;
};

}  // namespace machines
