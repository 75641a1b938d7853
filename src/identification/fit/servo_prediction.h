// SPDX-License-Identifier: BSD-3-Clause
// A record made ready for many predictions by rigs that differ in their parameters.
#pragma once

#include <memory>
#include <vector>

#include "backlash_diagnosis/identification/fit/output_error.h"

namespace backlash::identification {

/// Recorded minus predicted, low-passed. No deflection where the load has no motion of its own.
struct ServoResiduals {
  std::shared_ptr<const simulation::DrivenLoad> load;
  std::vector<double> torque, deflection;  // N m, rad
  // N m, without low-pass, 0 where dry friction may take any value. Never read from the recorded torque.
  std::vector<double> predicted_torque;
  std::vector<double> mesh_torque;  // N m, as terms see it (driven_load.h)
};

class SimulatedLoads;

struct LoadAsked {
  model::Rig rig;
  Calibration calibration;
};

struct PreparedServo {
  /// `data` must outlive it.
  PreparedServo(const ServoData& data, double cutoff, double feedback);

  /// The motor's torque [N m], averaged as the second difference of the motor position averages it.
  std::vector<double> acting_torque(const model::Rig& rig, const Calibration& calibration) const;
  /// Safe to call from several threads. Simulated loads are cached: a rig that differs only in parameters
  /// that do not move the load is not simulated again.
  ServoResiduals residuals(const model::Rig& rig, const Calibration& calibration) const;

  /// Simulates at once the loads that residuals() will be asked for next, which it then finds.
  void prepare(const std::vector<LoadAsked>& asked) const;

  const ServoData& data() const { return *data_; }
  double cutoff, feedback;     // Hz, 1/s
  std::vector<int> direction;  // +1, -1: the motor slides that way; 0: dry friction may take any value
  std::vector<char> settled;   // away from the ends of the record
  std::vector<char> counts;    // settled, and the motor slides

 private:
  bool is_bridged(long begin, long end, double torque_noise) const;
  void leave_out_lost(bool drawn);
  ServoResiduals coupled_residuals(const model::Rig& rig, const Calibration& calibration) const;

  const ServoData* data_;  // of the caller
  std::vector<double> torque_of_moment_, torque_held_;
  std::shared_ptr<SimulatedLoads> loads_;
};

}  // namespace backlash::identification
