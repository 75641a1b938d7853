// SPDX-License-Identifier: BSD-3-Clause
// An arm under test: plant, sensors of each joint and sampling clock. The simulator node and the command
// `simulate` step this.
#pragma once

#include <memory>
#include <vector>

#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/geared_arm/plant.h"
#include "backlash_diagnosis/record/csv.h"

namespace backlash::geared_arm {

class ArmSimulation {
 public:
  /// Throws BadData where the file of the arm does not say how to run it.
  explicit ArmSimulation(const GearedArm& arm);

  /// Measures sample number index() of each joint at time index() / sampling_rate, then moves on to the next
  /// one. The first sample is the arm at rest at time 0. motor_torque, motor_position, load_position, and
  /// what else `sensors` declares; all else is NaN. Throws IntegrationError.
  std::vector<model::Observation> step();

  long index() const { return index_; }
  double sampling_rate() const { return arm_.sensors.sampling_rate; }
  ArmPlant& plant() { return *plant_; }  // another one after each reset()
  const ArmPlant& plant() const { return *plant_; }
  simulation::SensorModel& sensors(std::size_t joint) { return sensors_[joint]; }

  /// Back to sample 0 with the backlash of the file; the noise starts again from its seed.
  void reset();

 private:
  GearedArm arm_;
  std::unique_ptr<ArmPlant> plant_;
  std::vector<simulation::SensorModel> sensors_;
  long index_ = 0;
};

/// What the sensors of all joints measure, from rest, for `duration` [s]. Deterministic for a seed. Throws
/// BadData, InvalidParameter, IntegrationError; Cancelled when `progress` returns false.
std::vector<record::JointRecord> simulate_arm(const GearedArm& arm, double duration,
                                              const Progress& progress = nullptr);

}  // namespace backlash::geared_arm
