// SPDX-License-Identifier: BSD-3-Clause
// What the noise of the sensors alone leaves of the residuals of an output-error fit.
//
// White noise of the torque; noise n_M of the motor position and n_L of the load position through the
// prediction, linear about teeth in contact, s = j 2 pi f, h the feedback (driven_load.h), F the low-pass of
// the load speed:
//   D = J_L s^2 + (b + J_L h) s + k,   Z = k + b s
//   torque      n_M [J_M s^2 + Z (1 - Z / D)] - n_L Z J_L h s F / D
//   deflection  n_M Z / D - n_L (1 - J_L h s F / D)
// Where the load stands Z / D is 0, where it moves with the motor Z is; there is no deflection then.
// A finite resolution of the load is no white noise while the load moves slowly: its error is that of the
// simulated motion, rounded.
#pragma once

#include <vector>

#include "backlash_diagnosis/identification/fit/servo_data.h"

namespace backlash::identification {

/// A residual beyond this many times the noise floor shows that the model lacks an effect.
constexpr double kShowsMissingEffect = 1.5;  // choice

struct NoiseFloors {
  double torque = 0, deflection = 0;  // N m, rad; standard deviations after the low-pass
};

/// Standard deviations of what the sensors add to a record. It takes as long as some runs of the load.
struct RecordNoise {
  double motor = 0, torque = 0;    // rad, N m
  double load = 0, load_step = 0;  // rad, with and of its resolution
};

RecordNoise record_noise(const ServoData& data);

/// `load` [rad]: the simulated motion. Of a contact law that is not linear the noise of the positions counts
/// without the mesh.
NoiseFloors noise_floors(const model::Rig& rig, const ServoData& data, const RecordNoise& noise,
                         const std::vector<double>& load, double cutoff, double feedback);

}  // namespace backlash::identification
