// SPDX-License-Identifier: BSD-3-Clause
// The equations of fit.h, linear about a state.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "backlash_diagnosis/arm/fit.h"

namespace backlash::arm {

constexpr Eigen::Index kDriveUnknowns = kDriveTerms + 2;  // the terms, kappa, delay
constexpr Eigen::Index kEffectUnknowns = 3;               // two values, shape

/// All that a fit may change.
struct State {
  std::vector<BodyParameters> links;
  std::vector<BodyParameters> payloads;            // of the body of each marked state, without the sign
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();  // rad
  Eigen::MatrixXd friction;                        // logarithms of the factors, joints x marked states
  Eigen::MatrixXd shift;                           // N m, of the offsets, joints x marked states
  Eigen::MatrixXd drives;                          // joints x kDriveUnknowns
  std::vector<JointEffect> effects;                // those that are free
};

/// Where the unknowns stand in one vector. `s` counts the marked states from 0.
struct Layout {
  Eigen::Index joints = 0, effects = 0, states = 1;
  Eigen::Index link(Eigen::Index i) const { return 10 * i; }
  Eigen::Index payload(Eigen::Index s = 0) const { return 10 * (joints + s); }
  Eigen::Index tilt() const { return payload(states); }
  Eigen::Index friction(Eigen::Index j, Eigen::Index s = 0) const { return tilt() + 2 + s * joints + j; }
  Eigen::Index shift(Eigen::Index j, Eigen::Index s = 0) const { return friction(j, states + s); }
  Eigen::Index drive(Eigen::Index j) const { return shift(0, states) + kDriveUnknowns * j; }
  Eigen::Index kappa(Eigen::Index j) const { return drive(j) + Eigen::Index(kDriveTerms); }
  Eigen::Index delay(Eigen::Index j) const { return kappa(j) + 1; }
  Eigen::Index effect(Eigen::Index i) const { return drive(joints) + kEffectUnknowns * i; }
  Eigen::Index size() const { return effect(effects); }
};

/// One joint in one motion: residual ~ sensitivity * step. All rows; those that do not count are to be left
/// out.
struct Linearised {
  std::vector<Eigen::Index> unknowns;  // of the columns
  Eigen::MatrixXd sensitivity;
  Eigen::VectorXd measured, predicted;
};

Layout layout_of(const ArmRig& rig, const FitFreedom& freedom);

/// Low-passed as the signal is, at the rows.
Eigen::VectorXd at_rows(const Eigen::VectorXd& all, const ArmMotion& motion, double cutoff);

class FitModel {
 public:
  FitModel(const ArmRig& rig, const FitFreedom& freedom) : rig_(rig), freedom_(freedom) {}

  State start() const;
  /// The chain's own torque of each joint at all samples.
  Eigen::MatrixXd chain_torque(const State& state, const FittedMotion& motion) const;
  /// What one unit of each value of an effect adds to the channel of joint `j`, at the rows. `chain`: of
  /// chain_torque(); `drives`: torques of all drives at the rows, without effects.
  Eigen::MatrixXd effect_at_rows(const State& state, const JointEffect& effect, std::size_t j,
                                 const ArmMotion& motion, const Eigen::MatrixXd& chain,
                                 const std::vector<Eigen::VectorXd>& drives) const;
  std::vector<Linearised> linearised(const State& state, const FittedMotion& motion) const;
  Chain chain(const State& state, std::size_t of) const;

 private:
  /// `tilt`: of the tilt's sensitivity, and what the tilt of the state adds to the torque; empty without.
  Linearised joint(const State& state, const FittedMotion& motion, std::size_t j, const Eigen::VectorXd& load,
                   const Eigen::MatrixXd& tilt) const;
  void add_effects(const State& state, const FittedMotion& motion, const Eigen::MatrixXd& chain,
                   std::vector<Linearised>& all) const;
  bool something_follows_load() const;
  double factor(const State& state, std::size_t j) const;  // channel per torque
  const ArmRig& rig_;
  const FitFreedom freedom_;  // its own: callers give `{}`
};

/// What a fit has found.
State state_of(const ArmFit& fit, const FitFreedom& freedom);

/// Gravity turned by tilt[0] about x and tilt[1] about y of the base.
Eigen::Vector3d tilted(const Eigen::Vector3d& gravity, const Eigen::Vector2d& tilt);

}  // namespace backlash::arm
