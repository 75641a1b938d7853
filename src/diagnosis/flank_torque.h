// SPDX-License-Identifier: BSD-3-Clause
// The torque that presses the flanks, of each window.
//
// Where the load moves its own encoder shows what moves it, whatever the motor's friction is:
//   T = J_L a_L + d_L w_L + C_L sign(w_L) + G(q)
// G is declared (gravity), or what the motor's torque shows of a weight that is not.
// Behind a sensor it is the sensor's torque. Of a locked output it is what the motor leaves,
//   T = tau - J_M a_M
#pragma once

#include <Eigen/Core>

#include "backlash_diagnosis/diagnosis/position_difference.h"
#include "flank_windows.h"

namespace backlash::diagnosis {

enum class TorqueBy { load, sensor, drive };

struct FlankTorque {
  Eigen::VectorXd torque;  // N m
  /// N m, one standard deviation of what may be wrong with it beside its scale, a column for each cause; the
  /// one that may choose another flank last.
  Eigen::MatrixXd unsure;
  Eigen::VectorXd still;  // N m, that dry friction may take to either side at a standstill
  double noise = 0;       // N m, white
  double level = 0;       // N m, large one (95 % quantile): there the laws of the teeth give the same
  double shown = 0;       // N m, rms of what the motor's torque shows that no declared term explains
};

FlankTorque flank_torque(const TwoEncoders& motion, const FlankWindows& windows, TorqueBy by,
                         const PositionDifferenceSettings& settings);

}  // namespace backlash::diagnosis
