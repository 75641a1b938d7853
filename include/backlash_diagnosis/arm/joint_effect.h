// SPDX-License-Identifier: BSD-3-Clause
// What the drive of one joint of an arm shows beside the terms of its equation (arm_rig.h): torque that it
// has to supply at the joint, N m. The laws are those of the terms of the same names of a joint by itself.
//
//   motor_coulomb                 T S                        dry friction that is more, or less, than the
//   motor_viscous                 b v                        term's; the same of viscous friction
//   cogging                       A sin(n q + p)             n periods per turn of the joint
//   position_dependent_friction   S A sin(n q + p)
//   stribeck                      T S exp(-(v / w_s)^2)      dry friction that is more at low speed
//   presliding                    -2 T S exp(-x / d)         x: way since the last reversal (Dahl 1968);
//                                                            friction T builds up over the distance d
//   asymmetric_viscous            a |v|                      a: half the difference of the directions
//   quadratic_drag                A v |v|
//   load_dependent_friction       mu S |tau|                 tau: the chain's own torque
//   motor_torque_gain             g u_j                      u_j: torque of this drive in the model; the
//                                                            recorded torque is larger by the share g, the
//                                                            motor's torque 1 / (1 + g) of it
//   transmission_coupling         c u_i                      u_i: torque of the drive of joint i in the
//                                                            model, as where the motor of a wrist sits on a
//                                                            shaft that also turns this joint
// S = tanh(v / v_0) as there.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::arm {

enum class EffectShape { none, order, speed, distance };  // what else it has beside its strength

/// A drive now.
struct DriveMoment {
  double q, v;  // rad, rad/s
  double sign;  // S
  double load;  // N m, the chain's own torque
};

struct JointEffectSpec {
  const char* id;
  Eigen::Index columns;                  // 2: of cosine and sine, a wave along the position
  const char *strength, *strength_unit;  // of one column; of two: the amplitude
  bool positive;                         // > 0, as friction is
  EffectShape shape = EffectShape::none;
  double least_order = 0;       // 1/rad, that is searched: below are links, and what drifts
  const char* drive_term = "";  // that is the same, where the rig file has it
  /// Torque of one unit of each value [N m]; null: more than the moment counts, or other drives do.
  Eigen::Vector2d (*units)(double shape, const DriveMoment& now) = nullptr;
  double most = std::numeric_limits<double>::infinity();  // of its strength, that is believed of a machine
  bool has_shape() const { return shape != EffectShape::none; }
};

const char* shape_name(EffectShape shape);  // as in files and reports
const char* shape_unit(EffectShape shape);

/// All that are known, simple ones first.
const std::vector<JointEffectSpec>& joint_effect_specs();

struct JointEffect {
  std::string id;
  double shape = 0;                                  // n [1/rad], w_s [rad/s] or d [rad]
  std::string other;                                 // joint i of a coupling; else empty
  Eigen::Vector2d values = Eigen::Vector2d::Zero();  // of cosine and sine [N m]; else {strength, 0}

  const JointEffectSpec& spec() const;
};

/// Throws BadData with file, line and key.
JointEffect read_joint_effect(const YamlReader& yaml);

/// As read_joint_effect() reads it, on one line.
std::string joint_effect_text(const JointEffect& effect);

}  // namespace backlash::arm
