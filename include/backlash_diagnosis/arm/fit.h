// SPDX-License-Identifier: BSD-3-Clause
// Fits an arm to its records: links, drives and torque constants together.
//
//   minimise  1/2 sum_j sum_k (s_j(t_k + d_j) - p_j(t_k))^2 / (sigma_j^2 c_j) + sum_links D(P, P_0) + ...
//   p_j = (tau_j + friction_j) exp(-kappa_j) / k_j,   D(P, P_0) = -log|P P_0^-1| + tr(P P_0^-1) - 4
//
// sigma_j is the residual's own deviation, c_j how many samples say the same once. D keeps every body
// physical: it is infinite where no mass distribution has the parameters. P_0 is the declared body, of
// whatever mass fits best, so that only its shape counts: at a weight of one as known to a factor of e or so,
// which matters only where the records say nothing (Lee, Wensing and Park 2020, IEEE T-RO 36:168). What must
// be positive in a drive has the same divergence in one dimension. All masses together are only as well known
// as the declared constants, kappa ~ N(0, e^2 + c^2 1 1^T) with each constant's own error e and the one that
// all share, c; a body of known mass in some of the records makes them as well known as its torque is
// measured. Standard errors are those of blocks left out, plus what the declared values
// leave open; of a payload also what friction that lags behind its model, by a tenth of Coulomb's (rms),
// could pass for: it follows the acceleration as inertia does, and no block of time knows better.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/motion.h"
#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::arm {

struct FitSettings {
  double declared_weight = 1;   // theory: of a declaration that is known to a factor of e
  double block = 2;             // s, longer than the memory of the residuals; choice, see test_fit.cpp
  int iterations = 12;          // choice: the step is below 1e-4 standard errors after eight
  double least_seconds = 5;     // of motion, in which a joint is known; choice
  double rotor_inertia = 0.5;   // kg m^2, to start from: of a joint that lifts some kilograms; choice
  double load_friction = 0.05;  // to start from: a good gear; choice
  double day = 0.3;         // of the logarithm of friction from day to day: a warm robot rubs half as much
                            // (Bittencourt and Axelsson, LiTH-ISY-R-3058)
  double day_shift = 0.1;   // of the offset from day to day, per Coulomb friction: as its asymmetry; choice
  double payload_mass = 1;  // kg, and
  double payload_radius = 0.1;  // m, to start from; choice
};

/// An effect of one joint, with values to start from.
struct FreeEffect {
  std::size_t joint = 0;
  JointEffect effect;
  double shape_spread = 0;  // how far its shape may be off
  bool everywhere = false;  // in all motions; else in those that are marked
  bool of_term = false;     // more or less of a term of the drive, which is then known
};

/// What a fit may change.
struct FitFreedom {
  bool links = true, drives = true, constants = true;
  std::optional<std::size_t> payload;  // at this link, in the motions that are marked
  double payload_sign = 1;
  /// Mass of the body [kg] in states 1, 2, ...: one body per state. NaN as error: not known. Empty: one body
  /// of unknown mass.
  std::vector<signal::Measured> weights;
  std::size_t states() const { return weights.empty() ? 1 : weights.size(); }
  bool tilt = false;                // of gravity, in the motions that are marked
  bool load = false;                // friction that follows the load, about what is known of it
  bool friction = false;            // of each joint, in the motions that are marked: a factor
  std::vector<std::size_t> steady;  // joints without such a factor
  std::vector<FreeEffect> effects;  // and with one the drive of its joint

  /// Whether the terms of a joint's drive are free.
  bool of_drive(std::size_t joint) const;
  /// Whether it has a factor of friction.
  bool rubs_otherwise(std::size_t joint) const;
};

/// A machine of several states shares all values but those that its states have of their own: body, factor of
/// friction, offset.
struct FittedMotion {
  const ArmMotion* motion = nullptr;
  std::size_t state = 0;  // 0: that of the links and drives; others are `marked`
  bool marked() const { return state > 0; }
};

/// A base parameter: a combination of the standard ones that the motions identify.
struct BaseParameter {
  std::string name;  // of the standard parameter that leads it
  signal::Measured measured;
  std::string unit;
};

/// Values of an effect: of its columns and its shape.
struct FittedEffect {
  JointEffect effect;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double middle = 0, spread = 0;  // rad, of its joint's position: mean and standard deviation
};

/// A joint whose records are not of one arm: relative errors, see fit_records.h.
struct Contradiction {
  std::string joint;
  double alone = 0, together = 0;
};

/// What a marked state has of its own.
struct FittedState {
  BodyParameters payload = BodyParameters::Zero();  // times the sign
  signal::Measured mass, centre[3];  // of the payload; of a fitted rig without the common error of constants
  Eigen::Matrix3d moment_covariance = Eigen::Matrix3d::Zero();  // (kg m)^2, of the payload's m c
  std::vector<double> shifts;                      // N m, of the joints' offsets, with the factors
  std::vector<signal::Measured> friction_factors;  // of the joints
};

struct ArmFit {
  ArmRig rig;  // with fitted values; payload and tilt are not in its chain, free effects not in its joints
  std::vector<FittedState> states = std::vector<FittedState>(1);  // 1, 2, ...
  const FittedState& marked() const { return states.front(); }    // where there is but one
  signal::Measured tilt[2];                                       // rad, about x and y of the base
  std::vector<FittedEffect> effects;                              // those that were free
  std::vector<std::vector<signal::Measured>> drives;              // per joint: kDriveTerms, constant, delay
  std::vector<BaseParameter> base;
  std::vector<double> deviation;     // sigma_j, unit of the channel; NaN for a joint that does not move
  std::vector<double> train, floor;  // per joint: norm(r) / norm(s - mean(s)); what white noise would leave
  Eigen::MatrixXd covariance;        // of all unknowns, in the order of the fit; empty: nothing was fitted
  bool weighed = false;              // fit_records(): a known weight has measured the constants
  std::vector<Contradiction> contradictions;  // fit_records() alone looks for them
  std::vector<std::string> warnings;
};

/// Starts from the rig's values. Throws CannotIdentify where no joint moves long enough; Cancelled.
ArmFit fit_arm(const ArmRig& rig, const std::vector<FittedMotion>& motions, const FitFreedom& freedom = {},
               const FitSettings& settings = {}, const Progress& progress = nullptr);

/// The signals that a fit predicts for a motion, at its rows (unit of the channel), and what it is to be
/// compared with.
struct Prediction {
  Eigen::MatrixXd measured, predicted;  // rows x joints
};
Prediction predict(const ArmFit& fit, const FitFreedom& freedom, const FittedMotion& motion);

/// norm(r) / norm(s - mean(s)) of each joint where it moves, over all motions; NaN where it moves less than
/// `least_seconds`.
std::vector<double> relative_errors(const ArmFit& fit, const FitFreedom& freedom,
                                    const std::vector<FittedMotion>& motions, double least_seconds);

/// What relative_errors() should be by the fit's own account: its residuals where it was fitted, and how well
/// it knows what each sample depends on. Needs `covariance`.
std::vector<double> expected_errors(const ArmFit& fit, const FitFreedom& freedom,
                                    const std::vector<FittedMotion>& motions, double least_seconds);

}  // namespace backlash::arm
