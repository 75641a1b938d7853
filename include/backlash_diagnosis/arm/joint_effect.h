// SPDX-License-Identifier: BSD-3-Clause
// What the drive of one joint of an arm shows beside the terms of its equation (arm_rig.h): torque that it
// has to supply at the joint, N m. Every term that shows in the torque of one joint (model/term_columns.h) is
// such an effect, but a weight, which the chain has; and
//
//   motor_coulomb, motor_viscous  dry and viscous friction that is more, or less, than the drive's term
//   motor_torque_gain             g u_j                      u_j: torque of this drive in the model; the
//                                                            recorded torque is larger by the share g, the
//                                                            motor's torque 1 / (1 + g) of it
//   transmission_coupling         c u_i                      u_i: torque of the drive of joint i in the
//                                                            model, as where the motor of a wrist sits on a
//                                                            shaft that also turns this joint
// Friction has the direction S as there.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/model/term_columns.h"

namespace backlash::arm {

enum class EffectShape { none, order, speed, distance };  // what else it has beside its strength

struct JointEffectSpec {
  std::string id;
  std::string strength, strength_unit;  // of one column; of two: the amplitude
  Eigen::Index columns = 1;             // 2: of cosine and sine, a wave along the position
  bool positive = false;                // > 0, as friction is
  EffectShape shape = EffectShape::none;
  std::string shape_name = "", shape_unit = "";
  double least_order = 0;                 // 1/rad, that is searched: below are links, and what drifts
  std::string drive_term = "";            // that is the same, where the rig file has it
  const model::TermType* type = nullptr;  // of the dictionary; null: one of those above
  double most = std::numeric_limits<double>::infinity();  // of its strength, that is believed of a machine
  bool has_shape() const { return shape != EffectShape::none; }
};

/// All that are known, simple ones first.
const std::vector<JointEffectSpec>& joint_effect_specs();

struct JointEffect {
  std::string id;
  double shape = 0;                                  // n [1/rad], w_s [rad/s] or d [rad]
  std::string other;                                 // joint i of a coupling; else empty
  Eigen::Vector2d values = Eigen::Vector2d::Zero();  // of cosine and sine [N m]; else {strength, 0}
  ParameterValues given = {};  // numbers of its term that are neither strength nor shape

  const JointEffectSpec& spec() const;
};

/// The torque of an effect, but of one that is a share of drives' torques (InvalidParameter).
class EffectLaw {
 public:
  explicit EffectLaw(const JointEffect& effect);
  /// Of one unit of each value [N m]; of one column the second is 0.
  Eigen::Vector2d units(const model::JointMoment& now) const;

 private:
  bool viscous_ = false;  // of an effect that no term is; else dry friction
  std::optional<model::TermColumns> term_;
};

/// Way [rad] since a joint last turned round, at samples of its speed [rad/s], which is straight between
/// them; before the first turn it counts as long ago.
Eigen::ArrayXd way_since_reversal(const Eigen::VectorXd& speed, double interval);

/// Throws BadData with file, line and key.
JointEffect read_joint_effect(const YamlReader& yaml);

/// As read_joint_effect() reads it, on one line.
std::string joint_effect_text(const JointEffect& effect);

}  // namespace backlash::arm
