// SPDX-License-Identifier: BSD-3-Clause
// Where skewness can separate backlash from something else that changes the signal, and where it cannot.
//
// At each backlash of a grid and each level of one disturbance that the curve does not know of, the machine
// is simulated, recorded a few times (other start within a period, other noise) and diagnosed with the curve
// of the undisturbed machine. The change of skewness that the disturbance alone causes is also reported as
// the backlash that would cause it:
//   equivalent = (skewness(backlash, level) - skewness(backlash, none)) / slope
// slope: of the whole curve, by least squares. It is the error of a user who reads backlash from the bare
// curve, as Sarkar, Ellis and Moore (1997, Section 9.1) do; the methods also check whether the record can be
// of this machine.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::studies {

/// The machine that is recorded, other than the curve believes.
struct DisturbedMachine {
  rig_file::RigFile file;
  double noise = 0;                          // standard deviation, of the signal's rms
  double sensor_gain = 1, sensor_delay = 0;  // of the torque sensor: -, s
  double load = 0;  // constant torque on the motor from outside, which motor_torque does not show; of the
                    // largest motor torque of the curve
};

struct Disturbance {
  std::string name;            // sensor_noise, ...
  std::string axis;            // what its levels count, for people
  double none = 0;             // level at which there is no disturbance; one of the levels
  std::vector<double> levels;  // increasing
  std::function<void(DisturbedMachine&, double level)> apply;
};

/// sensor_noise, motor_viscous_damping, motor_dry_friction, load_torque, coupling_stiffness, motor_inertia,
/// contact_stiffness, sensor_gain, sensor_delay, encoder_skew: those that the rig can have, with the levels
/// of the map.
std::vector<Disturbance> disturbances_of(const rig_file::RigFile& file);

struct SeparabilityRequest {
  int backlash_values = 17;  // >= 2, evenly over the curve
  int records = 3;           // >= 1, per cell
  int periods = 10;          // >= 1, per record, after settling
  double noise = 0.02;       // of the signal's rms, >= 0: of the maps of all other disturbances
  std::uint64_t seed = 1;
  bool waveform = false;  // the estimator that takes seconds a record
};

/// What a method said about the records of a cell.
struct SeparabilityAnswer {
  int right = 0;        // status ok and the 95 % interval holds the truth
  int wrong = 0;        // it does not; or above_range with a lower bound above the truth
  int refused = 0;      // any other status
  double error = kNaN;  // m, median of estimate (or that bound) - truth where not refused
  diagnosis::Status status = diagnosis::Status::ok;  // the most frequent one
  std::string reason;                                // of the first record with it, where it is not ok
};

struct SeparabilityCell {
  double skewness = kNaN;                   // mean over the records
  double equivalent = kNaN;                 // m, see above; NaN where the curve does not fall
  std::vector<SeparabilityAnswer> answers;  // by method, as in the map
};

struct SeparabilityMap {
  Disturbance disturbance;
  std::vector<std::vector<SeparabilityCell>> cells;  // [level][backlash]
};

struct Separability {
  std::vector<std::string> methods = {"apd_skewness", "apd_shape", "waveform", "combined"};  // the verdict
  double slope = kNaN;           // 1/m, of the curve; NaN where it does not fall
  std::vector<double> backlash;  // m (angular mesh: rad), total free play
  std::vector<double>
      resolution;  // m, half of the 95 % interval that the scatter of skewness leaves, by the slope
  std::vector<SeparabilityMap> maps;
};

/// Records at the sampling rate of the curve. Throws InvalidParameter, IntegrationError, Cancelled.
/// Deterministic for a seed, on any number of processors; a cell does not depend on the others.
Separability map_separability(const rig_file::RigFile& file, const diagnosis::MonitoringCurve& curve,
                              const std::vector<Disturbance>& disturbances,
                              const SeparabilityRequest& request, const Progress& progress = nullptr);

}  // namespace backlash::studies
