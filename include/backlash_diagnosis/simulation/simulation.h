// A rig under test: plant, sensors and sampling clock. The simulator node and the command `simulate` step this.
#pragma once

#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "backlash_diagnosis/simulation/sensor_model.h"

namespace backlash {

/// The test run that a rig file describes (`excitation`, `sensors`, `solver`).
struct SimulationSettings {
  ExcitationSettings excitation;
  SensorsSettings sensors;
  SolverSettings solver;
};

SimulationSettings read_simulation_settings(const YamlReader& yaml);

class Simulation {
 public:
  Simulation(const Rig& rig, const SimulationSettings& settings);

  /// Measures sample number index() at time index() / sampling_rate, then moves on to the next one. The first sample is
  /// the rig at rest in the middle of its gap at time 0. Throws IntegrationError.
  Observation step();

  long index() const { return index_; }
  double sampling_rate() const { return rate_; }
  Plant& plant() { return plant_; }
  const Plant& plant() const { return plant_; }

  /// Back to sample 0 with the rig file's backlash; the noise starts again from its seed.
  void reset();

 private:
  Plant plant_;
  SensorModel sensors_;
  double rate_;
  long index_ = 0;
};

/// Runs a rig for `duration` [s] and returns all that its sensors measured. Deterministic for a seed.
/// Throws IntegrationError; Cancelled when `progress` returns false.
Record simulate_record(const Rig& rig, const SimulationSettings& settings, double duration,
                       const Progress& progress = nullptr);

}  // namespace backlash
