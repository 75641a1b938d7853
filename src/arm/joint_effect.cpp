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

Eigen::Vector2d coulomb(double, const DriveMoment& now) {
  return {now.sign, 0};
}
Eigen::Vector2d viscous(double, const DriveMoment& now) {
  return {now.v, 0};
}
Eigen::Vector2d load_friction(double, const DriveMoment& now) {
  return {now.sign * std::fabs(now.load), 0};
}
Eigen::Vector2d drag(double, const DriveMoment& now) {
  return {now.v * std::fabs(now.v), 0};
}
Eigen::Vector2d asymmetric(double, const DriveMoment& now) {
  return {std::fabs(now.v), 0};
}
Eigen::Vector2d stribeck(double speed, const DriveMoment& now) {
  const double x = now.v / speed;
  return {now.sign * std::exp(-x * x), 0};
}
Eigen::Vector2d wave(double order, const DriveMoment& now) {
  return {std::cos(order * now.q), std::sin(order * now.q)};
}
Eigen::Vector2d rubbing_wave(double order, const DriveMoment& now) {
  return now.sign * wave(order, now);
}

}  // namespace

const std::vector<JointEffectSpec>& joint_effect_specs() {
  constexpr EffectShape kNone = EffectShape::none, kOrder = EffectShape::order;
  static const std::vector<JointEffectSpec> all = {
      {"motor_coulomb", 1, "torque", "N m", false, kNone, 0, "coulomb", coulomb},
      {"motor_viscous", 1, "damping", "N m s/rad", false, kNone, 0, "viscous", viscous},
      {"load_dependent_friction", 1, "coefficient", "-", true, kNone, 0, "load", load_friction},
      {"quadratic_drag", 1, "drag", "N m s^2/rad^2", true, kNone, 0, "quadratic", drag},
      {"asymmetric_viscous", 1, "damping", "N m s/rad", false, kNone, 0, "", asymmetric},
      {"stribeck", 1, "torque", "N m", true, EffectShape::speed, 0, "", stribeck},
      {"presliding", 1, "torque", "N m", true, EffectShape::distance},
      {"motor_torque_gain", 1, "gain", "-", false, kNone, 0, "", nullptr, 0.3},
      {"transmission_coupling", 1, "ratio", "-", false, kNone, 0, "", nullptr, 1},
      {"position_dependent_friction", 2, "amplitude", "N m", false, kOrder, 1, "", rubbing_wave},
      {"cogging", 2, "amplitude", "N m", false, kOrder, 3, "", wave}};
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

bool stands_for(const JointEffectSpec& spec, DriveTerm term) {
  return std::string(kDriveTermSpecs[std::size_t(term)].name) == spec.drive_term;
}

bool stands_for_term(const JointEffectSpec& spec, const ArmRig& rig) {
  return std::any_of(rig.terms.begin(), rig.terms.end(), [&](DriveTerm t) { return stands_for(spec, t); });
}

JointEffect gain_of_drive() {
  return {"motor_torque_gain", 0, "", Eigen::Vector2d::Zero()};
}

bool is_gain(const JointEffect& effect) {
  return effect.id == gain_of_drive().id;
}

bool is_of_drives(const JointEffect& effect) {
  return is_coupling(effect) || is_gain(effect);
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

/// Way since the joint last turned round, at the samples; before the first turn it counts as long ago.
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
  const JointEffectSpec& spec = effect.spec();
  if (spec.shape == EffectShape::distance)
    return -2 * m.sign.col(j).array() * (-way_since_reversal(m, j) / effect.shape).exp();
  if (!spec.units) throw InvalidParameter("effect", effect.id, "has no column of one joint");
  Eigen::MatrixXd out(m.q.rows(), spec.columns);
  for (Eigen::Index k = 0; k < out.rows(); ++k)
    out.row(k) =
        spec.units(effect.shape, {m.q(k, j), m.motor_v(k, j), m.sign(k, j), load[k]}).head(spec.columns);
  return out;
}

}  // namespace backlash::arm
