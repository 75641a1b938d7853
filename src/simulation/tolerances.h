// SPDX-License-Identifier: BSD-3-Clause
// What the error of each state of a gear train is measured by.
#pragma once

#include <algorithm>
#include <vector>

#include "backlash_diagnosis/simulation/integrator.h"

namespace backlash::simulation {

/// Elastic deflections and play are differences of angles and far below this; beyond it no angle says more
/// about them.
constexpr double kLargestAngle = 0.1;  // rad

/// Angles first, then speeds.
inline std::vector<StateTolerance> state_tolerances(int dof, const SolverSettings& solver) {
  std::vector<StateTolerance> tolerances(2 * dof, {solver.position_tolerance, kLargestAngle});
  std::fill(tolerances.begin() + dof, tolerances.end(), StateTolerance{solver.velocity_tolerance});
  return tolerances;
}

}  // namespace backlash::simulation
