// SPDX-License-Identifier: BSD-3-Clause
// Rigs that are moved together; each by steps of its own (lane_step.h).
#pragma once

#include <memory>
#include <vector>

#include "backlash_diagnosis/simulation/excitation.h"
#include "backlash_diagnosis/simulation/integrator.h"

namespace backlash::simulation {

class RigGroup {
 public:
  virtual ~RigGroup() = default;

  /// After a jump of the torque the derivative is another and the step that suits it unknown.
  virtual void restart(double t, double torque) = 0;
  /// Moves all to t [s], not beyond `stop`, where the torque jumps next.
  virtual void advance_to(double t, double stop, const Excitation& excitation, long segment) = 0;
  /// Number i of a rig's state, where it was moved to.
  virtual double state(int rig, int i) const = 0;
  virtual long steps() const = 0;  // attempts at one
};

/// How many of so many rigs the next group is to hold.
std::size_t rigs_of_group(std::size_t count);

/// `held`: the torque is constant between jumps.
std::unique_ptr<RigGroup> make_group(const std::vector<model::GearTrain>& trains,
                                     const SolverSettings& solver, bool at_load, bool held);

}  // namespace backlash::simulation
