// SPDX-License-Identifier: BSD-3-Clause
// The load about crossings of the gap, moved by the recorded motor, and the torque that a machine needs for
// that. Equations: gap_traverse.h.
#pragma once

#include <Eigen/Core>
#include <array>

#include "traverse_data.h"

namespace backlash::diagnosis {

enum TraverseValue {
  kTraverseGap,
  kTraverseStiffness,
  kTraverseDamping,
  kTraverseLoadInertia,
  kTraverseMotorInertia,
  kTraverseMotorDamping,
  kTraverseMotorFriction,
  kTraverseLoadFriction,
  kTraversePower,    // -, of the torque of the teeth over the deflection: 1 for a spring, 1.5 after Hertz
  kTraverseEarlier,  // -, share of the torque of the sample before: 0.5 where it is held between samples
  kTraverseValues
};
using TraverseMachine = std::array<double, kTraverseValues>;
/// Of one crossing: position and rate of the load at the first sample beyond what the torque there tells,
/// rad, rad/s, and torques on motor and load that nothing else tells (gravity, cogging, friction that
/// drifts), N m.
enum TraverseOwnValue { kOwnPosition, kOwnRate, kOwnMotorTorque, kOwnLoadTorque, kTraverseOwn };
using TraverseOwn = Eigen::Matrix<double, kTraverseOwn, 1>;

/// A machine in one window.
struct TraverseRun {
  const TraverseWindow* window = nullptr;
  TraverseMachine machine{};
  TraverseOwn own = TraverseOwn::Zero();
};

/// Whether the motion of the load depends on a value of the machine or, from kTraverseValues on, of the
/// crossing. The others count in traverse_residual() alone.
bool moves_load(int value);

constexpr int kTraverseRuns = 8;  // moved at once: two registers of AVX2, so that their waits overlap

/// Torque through the teeth about each sample of the window, N m, a column for each run; weighted 1 - |t| /
/// interval, which is what a second difference of the position sees. A run's does not depend on the others,
/// nor on the processor as far as its pow() does not. Fastest for multiples of kTraverseRuns.
Eigen::MatrixXd traverse_teeth(const TraverseData& data, const std::vector<TraverseRun>& runs);

/// Recorded torque less what the machine needs with this torque through the teeth, N m, at each sample of the
/// window; 0 where it does not count.
Eigen::VectorXd traverse_residual(const TraverseData& data, const TraverseRun& run,
                                  const Eigen::Ref<const Eigen::VectorXd>& teeth);

}  // namespace backlash::diagnosis
