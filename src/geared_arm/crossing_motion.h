// SPDX-License-Identifier: BSD-3-Clause
// The links of an arm moved by its recorded motors through teeth with gaps. Equations: geared_arm/traverse.h.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "crossing_data.h"

namespace backlash::geared_arm {

/// What is fitted of each joint.
enum CrossingValue {
  kCrossingGap,        // rad, >= 0
  kCrossingStiffness,  // logarithm, over the declared one
  kCrossingDamping,    // the same
  kCrossingPower,      // of the torque of the teeth over the deflection: 1 a spring, 1.5 after Hertz
  kCrossingRotor,      // logarithm, over the declared one; what the motor moves in all stays the same
  kCrossingCoulomb,    // N m, of the link
  kCrossingEarlier,    // samples: the torque of a sample holds that much before it
  kCrossingValues
};
using CrossingMachine = std::vector<std::array<double, kCrossingValues>>;  // one per joint of CrossingData

/// How long a joint's teeth touched nothing, between flanks of either sign.
struct Flight {
  std::size_t joint;      // of CrossingData
  Eigen::Index from, to;  // samples
  int flank;              // touched at its end
};

constexpr std::size_t kMostGaps = 16;  // joints that are looked at together; choice (time)

/// Torque through the teeth, mean between a sample and the next: samples - 1 rows [N m]. `own`: of this
/// window, beta [N m] per joint, then per joint how much wider than the machine's its gap is [rad].
/// `flights`, where asked for, takes those that end on the other flank.
Eigen::MatrixXd mesh_torques(const CrossingData& data, const CrossingWindow& window,
                             const CrossingMachine& machine, const Eigen::VectorXd& own,
                             std::vector<Flight>* flights = nullptr);

}  // namespace backlash::geared_arm
