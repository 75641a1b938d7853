// SPDX-License-Identifier: BSD-3-Clause
// The equations of fit.h, linear about a state.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "backlash_diagnosis/arm/fit.h"

namespace backlash::arm {

constexpr Eigen::Index kDriveUnknowns = kDriveTerms + 2;  // the terms, kappa, delay

/// All that a fit may change.
struct State {
  std::vector<BodyParameters> links;
  BodyParameters payload = BodyParameters::Zero();  // of the body, without the sign
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();   // rad
  Eigen::VectorXd friction;                         // logarithms of the factors, one per joint
  Eigen::VectorXd shift;                            // N m, of the offsets
  Eigen::MatrixXd drives;                           // joints x kDriveUnknowns
};

/// Where the unknowns stand in one vector.
struct Layout {
  Eigen::Index joints = 0;
  Eigen::Index link(Eigen::Index i) const { return 10 * i; }
  Eigen::Index payload() const { return 10 * joints; }
  Eigen::Index tilt() const { return payload() + 10; }
  Eigen::Index friction(Eigen::Index j) const { return tilt() + 2 + j; }
  Eigen::Index shift(Eigen::Index j) const { return friction(joints) + j; }
  Eigen::Index drive(Eigen::Index j) const { return shift(joints) + kDriveUnknowns * j; }
  Eigen::Index kappa(Eigen::Index j) const { return drive(j) + Eigen::Index(kDriveTerms); }
  Eigen::Index delay(Eigen::Index j) const { return kappa(j) + 1; }
  Eigen::Index size() const { return drive(joints); }
};

/// One joint in one motion: residual ~ sensitivity * step. All rows; those that do not count are to be left
/// out.
struct Linearised {
  std::vector<Eigen::Index> unknowns;  // of the columns
  Eigen::MatrixXd sensitivity;
  Eigen::VectorXd measured, predicted;
};

class FitModel {
 public:
  FitModel(const ArmRig& rig, const FitFreedom& freedom) : rig_(rig), freedom_(freedom) {}

  State start() const;
  std::vector<Linearised> linearised(const State& state, const FittedMotion& motion) const;
  Chain chain(const State& state, bool marked) const;

 private:
  /// `tilt`: of the tilt's sensitivity, and what the tilt of the state adds to the torque; empty without.
  Linearised joint(const State& state, const FittedMotion& motion, std::size_t j, const Eigen::VectorXd& load,
                   const Eigen::MatrixXd& tilt) const;
  const ArmRig& rig_;
  const FitFreedom& freedom_;
};

/// Gravity turned by tilt[0] about x and tilt[1] about y of the base.
Eigen::Vector3d tilted(const Eigen::Vector3d& gravity, const Eigen::Vector2d& tilt);

}  // namespace backlash::arm
