// SPDX-License-Identifier: BSD-3-Clause
// Parts of the play from the hysteresis loop of torque against motor position, output locked.
//
// With play g, flank stiffness k and Coulomb torque Fc, the motor moves at
//   u = f(x) + Fc (up), u = f(x) - Fc (down), f(x) = 0 in the gap and k (x -+ g/2) on the flanks,
// so at every position half the sum of both branches is the elastic characteristic and half their difference
// the friction:
//   m(x) = (u_up + u_down) / 2, w(x) = (u_up - u_down) / 2.
// A branch is the torque at the first passage of each position between the walls, median over the passages.
//
// - coulomb: median of w over the middle half of the travel.
// - compliance: slope c of the lines x = x0 + c m through the flanks, fitted from 0.3 to 0.9 of the largest
//   abs(m) of each side, mean of both sides. Its reciprocal is the torsional stiffness.
// - gap: x0(+) - x0(-), the flank lines extrapolated to zero torque, not below 0.
//
// Exact for the model above; descriptive for machines whose friction or stiffness depends on load.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/diagnosis/wall_reading.h"

namespace backlash::diagnosis {

struct HysteresisLoop {
  PlayComponents components;     ///< at_torque is left NaN
  double flank_friction = kNaN;  ///< N m, median of w where the flank lines are fitted
  std::string missing;           ///< why components are NaN; empty when all are there
};

/// Analyses the passages between neighbouring excursions of opposite sides over positions from `lower` to
/// `upper` [rad, lower < upper]. Position must have no drift.
HysteresisLoop analyse_hysteresis(const LockedMotion& motion, const std::vector<TorqueExcursion>& excursions,
                                  double lower, double upper);

}  // namespace backlash::diagnosis
