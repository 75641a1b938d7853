// Parts of the play from the hysteresis loop of torque against motor position, output locked.
//
// With play g, flank stiffness k and Coulomb torque Fc, the motor moves at
//   u = f(x) + Fc (moving up),  u = f(x) - Fc (moving down),   f(x) = 0 in the gap, k (x -+ g/2) on the
//   flanks,
// so at every position half the sum of both branches is the elastic characteristic, half their difference the
// friction:
//   m(x) = (u_up + u_down) / 2,   w(x) = (u_up - u_down) / 2.
// Branches: the torque at the first passage of each position on the way from wall to wall, median over the
// passages.
//   coulomb     median of w over the middle half of the travel
//   compliance  dx/dm of the straight lines x = x0 + c m through the flanks, 0.3 to 0.9 of the largest abs(m)
//   of a side;
//               mean of both sides (torsional rigidity is its reciprocal; gear makers fit it likewise to the
//               upper part)
//   gap         x0(+) - x0(-): the flank lines extrapolated to zero torque, not below 0
// These definitions are exact for the model above and remain descriptive for machines whose friction depends
// on load.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/diagnosis/wall_reading.h"

namespace backlash {

struct HysteresisLoop {
  PlayComponents components;     ///< at_torque is left NaN
  double flank_friction = kNaN;  ///< N m, median of w where the flank lines are fitted
  std::string missing;           ///< why components are NaN; empty when all are there
};

/// Analyses the passages between neighbouring excursions of opposite sides over positions from `lower` to
/// `upper` [rad, lower < upper]. Position must have no drift.
HysteresisLoop analyse_hysteresis(const LockedMotion& motion, const std::vector<TorqueExcursion>& excursions,
                                  double lower, double upper);

}  // namespace backlash
