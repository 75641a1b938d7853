// SPDX-License-Identifier: BSD-3-Clause
// A rig under test: plant, sensors and sampling clock. The simulator node and the command `simulate` step
// this.
//
// Where the torque acts later than its stamp says (Sensing::torque_delay d > 0), a sample of time t holds the
// torque of t and all else as it was at t - d; where it acts earlier, the torque of t - |d| and all else of
// t. The load's position and speed are later by Rig::encoder_skew than the motor's, or earlier where that is
// < 0. All moments are simulated, not interpolated. Before time 0 the rig was at rest without torque.
#pragma once

#include <deque>

#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "backlash_diagnosis/simulation/sensor_model.h"

namespace backlash::simulation {

/// The test run that a rig file describes (`excitation`, `sensors`, `solver`).
struct SimulationSettings {
  ExcitationSettings excitation;
  SensorsSettings sensors;
  SolverSettings solver;
};

SimulationSettings read_simulation_settings(const YamlReader& yaml);

class Simulation {
 public:
  Simulation(const model::Rig& rig, const SimulationSettings& settings);

  /// Measures sample number index() at time index() / sampling_rate, then moves on to the next one. The first
  /// sample is the rig at rest in the middle of its gap at time 0. Throws IntegrationError.
  model::Observation step();

  long index() const { return index_; }
  double sampling_rate() const { return rate_; }
  Plant& plant() { return plant_; }
  const Plant& plant() const { return plant_; }
  SensorModel& sensors() { return sensors_; }
  const SensorModel& sensors() const { return sensors_; }

  /// Back to sample 0 with the rig file's backlash; the noise starts again from its seed.
  void reset();

 private:
  /// Samples that are some time older than their stamps.
  struct Late {
    double delay;                              // s, >= 0
    long samples;                              // the delay is so many samples
    double after_sample;                       // s, less this
    std::deque<model::Observation> past = {};  // the next `samples` of them
  };
  static Late late(double delay, double rate);
  model::Observation observe();
  void forget();

  Plant plant_;
  SensorModel sensors_;
  double rate_;
  Late torque_, motor_, load_;  // what a sample shows of the torque, of the load and of all else
  long index_ = 0;
};

/// Runs a rig for `duration` [s] and returns all that its sensors measured. Deterministic for a seed.
/// Throws IntegrationError; Cancelled when `progress` returns false.
record::Record simulate_record(const model::Rig& rig, const SimulationSettings& settings, double duration,
                               const Progress& progress = nullptr);

}  // namespace backlash::simulation
