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
  kTraverseLoadDamping,
  kTraverseLoadTerms,  // -, times the torque that declared terms take of the load
  kTraversePower,      // -, of the torque of the teeth over the deflection: 1 for a spring, 1.5 after Hertz
  kTraverseHardening,  // -, >= 0, h: beside the power, as (1 + h x^2) / (1 + h) of the deflection x over the
                       // usual one
  kTraverseDampingPower,  // -, >= 0, of the damping over the deflection: 0 for a damper, 1.5 after Hunt and
                          // Crossley (1975)
  kTraverseLate,          // -, share of the torque of the sample before: 0.5 where it is held between samples
  // N m, of two waves of the motor's torque over its turn (TraverseData::waves): cogging, an eccentric first
  // stage
  kTraverseWave,
  kTraverseLastWave = kTraverseWave + kTorqueWaves - 1,
  kTraverseSkew,  // s, by which the load's encoder is late
  kTraverseZero,  // rad, of what it shows too much, everywhere
  kTraverseSine,
  kTraverseCosine,  // rad, of what it shows too much, by its angle: an eccentric disk
  kTraverseValues
};
using TraverseMachine = std::array<double, kTraverseValues>;
/// Of one window: position and rate of the load at the first sample beyond what is read or the torque there
/// says, rad, rad/s; torques on motor and load that nothing else explains (gravity, cogging, friction that
/// drifts), N m; and how much the load's encoder shows too much, rad.
enum TraverseOwnValue { kOwnPosition, kOwnRate, kOwnMotorTorque, kOwnLoadTorque, kOwnShown, kTraverseOwn };
using TraverseOwn = Eigen::Matrix<double, kTraverseOwn, 1>;

/// A machine in one window.
struct TraverseRun {
  const TraverseWindow* window = nullptr;
  TraverseMachine machine{};
  TraverseOwn own = TraverseOwn::Zero();
};

constexpr int kTraverseRuns = 8;  // moved at once: two registers of AVX2, so that their waits overlap

/// A column for each run, a row for each sample of the window.
struct TraverseMotion {
  Eigen::MatrixXd
      teeth;  // N m through the teeth, weighted 1 - |t| / interval, which is what a second difference sees
  Eigen::MatrixXd position, rate;  // of the load, rad, rad/s
};

/// A run's does not depend on the others, nor on the processor as far as its pow() does not. Fastest for
/// multiples of kTraverseRuns.
TraverseMotion traverse_motion(const TraverseData& data, const std::vector<TraverseRun>& runs);

/// rad, by which the load's encoder shows too much at a sample of the record.
double shown_too_much(const TraverseData& data, const TraverseRun& run, std::size_t sample);

/// Recorded torque less what the machine needs with this torque through the teeth, N m, at each sample of the
/// window; 0 where it does not count.
Eigen::VectorXd traverse_residual(const TraverseData& data, const TraverseRun& run,
                                  const Eigen::Ref<const Eigen::VectorXd>& teeth);

/// Recorded position of the load less what its encoder shows of this motion, rad.
Eigen::VectorXd load_residual(const TraverseData& data, const TraverseRun& run,
                              const Eigen::Ref<const Eigen::VectorXd>& position,
                              const Eigen::Ref<const Eigen::VectorXd>& rate);

}  // namespace backlash::diagnosis
