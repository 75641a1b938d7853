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
  kCrossingStiffness,  // over the declared one
  kCrossingDamping,    // the same
  kCrossingPower,      // of the torque of the teeth over the deflection: 1 a spring, 1.5 after Hertz
  kCrossingRotor,      // over the declared one; what the motor moves in all stays the same
  kCrossingCoulomb,    // N m, of the link
  kCrossingEarlier,    // samples: the torque of a sample holds that much before it
  kCrossingValues
};
using CrossingMachine = std::vector<std::array<double, kCrossingValues>>;  // one per joint of CrossingData

/// Of a window alone, each per joint: beta [N m]; how much wider than the machine's its gap is [rad]; what
/// the link is at its first sample beside a link that rests on its flank: deflection of the teeth [rad], its
/// rate.
constexpr int kCrossingOwn = 4;

/// How long a joint's teeth touched nothing, between flanks of either sign.
struct Flight {
  std::size_t joint;      // of CrossingData
  Eigen::Index from, to;  // samples
  int flank;              // touched at its end
};

constexpr std::size_t kMostGaps = 16;  // joints that are looked at together; choice (time)

/// Inverse of the mass matrix of the links at each sample [1 / (kg m^2)]: what a machine moves to the rotors
/// is taken from the links.
using LinkMobilities = std::vector<Eigen::MatrixXd>;
LinkMobilities link_mobilities(const CrossingData& data, const CrossingWindow& window,
                               const CrossingMachine& machine);

/// Torque through the teeth, mean between a sample and the next: samples - 1 rows [N m]. `own`: see
/// kCrossingOwn. `flights`, where asked for, takes those that end on the other flank.
Eigen::MatrixXd mesh_torques(const CrossingData& data, const CrossingWindow& window,
                             const LinkMobilities& mobilities, const CrossingMachine& machine,
                             const Eigen::VectorXd& own, std::vector<Flight>* flights = nullptr);

}  // namespace backlash::geared_arm
