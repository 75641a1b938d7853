// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/joint_effect.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "joint_effects.h"

namespace backlash::arm {
namespace {

constexpr double kLeastGain = -0.9,
                 kMostGain = 10;  // -: a motor gives 1 / (1 + g) of what is recorded; choice

}  // namespace

const std::vector<JointEffectSpec>& joint_effect_specs() {
  static const std::vector<JointEffectSpec> all = {
      {"motor_coulomb", 1, "torque", "N m", false, EffectShape::none, 0, "coulomb"},
      {"motor_viscous", 1, "damping", "N m s/rad", false, EffectShape::none, 0, "viscous"},
      {"load_dependent_friction", 1, "coefficient", "-", true, EffectShape::none, 0, "load"},
      {"quadratic_drag", 1, "drag", "N m s^2/rad^2", true, EffectShape::none, 0, "quadratic"},
      {"asymmetric_viscous", 1, "damping", "N m s/rad", false},
      {"stribeck", 1, "torque", "N m", true, EffectShape::speed},
      {"presliding", 1, "torque", "N m", true, EffectShape::distance},
      {"motor_torque_gain", 1, "gain", "-", false},
      {"transmission_coupling", 1, "ratio", "-", false},
      {"position_dependent_friction", 2, "amplitude", "N m", false, EffectShape::order, 1},
      {"cogging", 2, "amplitude", "N m", false, EffectShape::order, 2}};
  return all;
}

const char* shape_name(EffectShape shape) {
  return shape == EffectShape::order ? "order" : shape == EffectShape::speed ? "speed" : "distance";
}

const char* shape_unit(EffectShape shape) {
  return shape == EffectShape::order ? "1/rad" : shape == EffectShape::speed ? "rad/s" : "rad";
}

const JointEffectSpec& JointEffect::spec() const {
  for (const JointEffectSpec& spec : joint_effect_specs())
    if (id == spec.id) return spec;
  throw InvalidParameter("effect", id, "is none of those of a joint of an arm");
}

bool is_coupling(const JointEffect& effect) {
  return effect.id == "transmission_coupling";
}

bool stands_for_term(const JointEffectSpec& spec, const ArmRig& rig) {
  return std::any_of(rig.terms.begin(), rig.terms.end(), [&](DriveTerm t) {
    return std::string(kDriveTermSpecs[std::size_t(t)].name) == spec.drive_term;
  });
}

JointEffect gain_of_drive() {
  return {"motor_torque_gain", 0, "", Eigen::Vector2d::Zero()};
}

bool is_of_drives(const JointEffect& effect) {
  return is_coupling(effect) || effect.id == gain_of_drive().id;
}

JointEffect read_joint_effect(const YamlReader& yaml) {
  JointEffect e;
  std::vector<std::string> known;
  for (const JointEffectSpec& spec : joint_effect_specs()) known.emplace_back(spec.id);
  e.id = yaml.choice("id", known);
  const JointEffectSpec& spec = e.spec();
  const Range range = e.id == gain_of_drive().id ? Range::between(kLeastGain, kMostGain)
                      : spec.positive            ? Range::positive()
                                                 : Range::any();
  const double strength = yaml.number(spec.strength, range);
  e.values[0] = strength;
  if (spec.columns == 2) {  // A sin(x + p) = A sin(p) cos(x) + A cos(p) sin(x)
    const double phase = yaml.number("phase", Range::any());
    e.values = {strength * std::sin(phase), strength * std::cos(phase)};
  }
  if (spec.has_shape()) e.shape = yaml.number(shape_name(spec.shape), Range::positive());
  if (is_coupling(e)) e.other = yaml.text("joint");
  return e;
}

std::string joint_effect_text(const JointEffect& effect) {
  const JointEffectSpec& spec = effect.spec();
  std::string text = fmt::format("{{id: {}", effect.id);
  if (is_coupling(effect)) text += ", joint: " + effect.other;
  if (spec.columns == 2)
    text += fmt::format(", {}: {:.8g}, phase: {:.8g}", spec.strength, effect.values.norm(),
                        std::atan2(effect.values[0], effect.values[1]));
  else
    text += fmt::format(", {}: {:.8g}", spec.strength, effect.values[0]);
  if (spec.has_shape()) text += fmt::format(", {}: {:.8g}", shape_name(spec.shape), effect.shape);
  return text + "}";
}

namespace {

/// Way since the joint last turned round, at the samples; before it first does, that is over.
Eigen::ArrayXd way_since_reversal(const ArmMotion& m, Eigen::Index j) {
  Eigen::ArrayXd way(m.motor_v.rows());
  double sum = INFINITY, before = 0;
  for (Eigen::Index k = 0; k < way.size(); ++k) {
    const double v = m.motor_v(k, j);
    sum = v * before < 0 ? 0 : sum + std::fabs(v) * m.interval;
    if (v != 0) before = v;
    way[k] = sum;
  }
  return way;
}

}  // namespace

Eigen::MatrixXd effect_columns(const JointEffect& effect, const ArmMotion& m, std::size_t joint,
                               const Eigen::VectorXd& load) {
  const auto j = Eigen::Index(joint);
  const Eigen::ArrayXd v = m.motor_v.col(j), s = m.sign.col(j), x = effect.shape * m.q.col(j).array();
  Eigen::MatrixXd out(v.size(), effect.spec().columns);
  const std::string& id = effect.id;
  if (id == "cogging")
    out << x.cos(), x.sin();
  else if (id == "position_dependent_friction")
    out << s * x.cos(), s * x.sin();
  else if (id == "stribeck")
    out << s * (-(v / effect.shape).square()).exp();
  else if (id == "presliding")
    out << -2 * s * (-way_since_reversal(m, j) / effect.shape).exp();
  else if (id == "motor_coulomb")
    out << s;
  else if (id == "motor_viscous")
    out << v;
  else if (id == "asymmetric_viscous")
    out << v.abs();
  else if (id == "quadratic_drag")
    out << v * v.abs();
  else if (id == "load_dependent_friction")
    out << s * load.array().abs();
  else
    throw InvalidParameter("effect", id, "has no column of one joint");
  return out;
}

}  // namespace backlash::arm
