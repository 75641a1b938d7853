// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/joint_effect.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/arm/arm_rig.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/weight_term.h"
#include "joint_effects.h"

namespace backlash::arm {
namespace {

constexpr double kLeastGain = -0.9,
                 kMostGain = 10;       // -: a motor gives 1 / (1 + g) of what is recorded; choice
constexpr double kMostBelieved = 0.3;  // -, of a gain that a machine has; choice
constexpr double kRounding = 1e-12;    // of torques of some N m

/// Only how an effect is searched depends on it.
model::MotionRange any_motion() {
  model::MotionRange range;
  range.torque = range.speed = range.duration = 1;
  return range;
}

// Below are links, which have one wave a turn, and their sums; friction they have none. Choice.
constexpr double kLeastOrder = 3, kLeastFrictionOrder = 1;  // 1/rad

model::TermColumns columns_of(const model::TermType& type, ParameterValues given, double shape) {
  if (const auto searched = model::searched_shape(type)) given[searched->name] = shape;
  return {type, given};
}

/// The drive's term of the same law; empty: none.
std::string drive_term_of(const model::TermColumns& term) {
  const model::JointMoment here{1, 0.3, 2, 0.9, 5, 0.1, 1}, there{2, 0.7, -3, -0.8, 7, 0.2, -1};
  for (std::size_t i = 0; i < kDriveTerms; ++i) {
    const auto same = [&](const model::JointMoment& now) {
      return std::fabs(term.at(0, now) - drive_unit(DriveTerm(i), now)) < kRounding;
    };
    if (same(here) && same(there)) return kDriveTermSpecs[i].name;
  }
  return "";
}

JointEffectSpec spec_of(const model::TermType& type, const model::TermColumns& term) {
  const ParameterSpec strength = model::regressed_strength(type);
  JointEffectSpec spec{type.id, strength.name, strength.unit, Eigen::Index(term.count())};
  spec.type = &type;
  spec.positive = term.count() == 1 && strength.range.lower >= 0;
  spec.drive_term = drive_term_of(term);
  if (const auto shape = model::searched_shape(type)) {
    spec.shape = model::has_order(type) ? EffectShape::order
                 : shape->unit == "rad" ? EffectShape::distance
                                        : EffectShape::speed;
    spec.shape_name = shape->name, spec.shape_unit = shape->unit;
    if (model::has_order(type)) spec.least_order = term.rubs() ? kLeastFrictionOrder : kLeastOrder;
  }
  return spec;
}

/// What all records of an arm show otherwise: weights are of its chain, a constant torque is the drive's
/// offset, friction of the day is a factor of all of a joint's.
bool is_of_a_drive(const model::TermType& type, const model::TermColumns& term) {
  return type.id != model::weight_term() && !term.is_constant() && !term.follows_time();
}

std::vector<JointEffectSpec> all_specs() {
  JointEffectSpec coulomb{"motor_coulomb", "torque", "N m"}, viscous{"motor_viscous", "damping", "N m s/rad"},
      gain{"motor_torque_gain", "gain", "-"}, coupling{"transmission_coupling", "ratio", "-"};
  coulomb.drive_term = kDriveTermSpecs[std::size_t(DriveTerm::coulomb)].name;
  viscous.drive_term = kDriveTermSpecs[std::size_t(DriveTerm::viscous)].name;
  gain.most = kMostBelieved, coupling.most = 1;
  std::vector<JointEffectSpec> all{coulomb, viscous, gain, coupling};
  for (const model::SearchedTerm& searched : model::searched_terms(model::ShownIn::torque, any_motion())) {
    if (searched.type->id == all.back().id) continue;  // another variant
    const model::TermColumns term = columns_of(*searched.type, searched.given, 1);
    if (is_of_a_drive(*searched.type, term)) all.push_back(spec_of(*searched.type, term));
  }
  return all;
}

}  // namespace

const std::vector<JointEffectSpec>& joint_effect_specs() {
  static const std::vector<JointEffectSpec> all = all_specs();
  return all;
}

EffectLaw::EffectLaw(const JointEffect& effect) {
  const JointEffectSpec& spec = effect.spec();
  if (is_of_drives(effect)) throw InvalidParameter("effect", effect.id, "has no column of one joint");
  if (spec.type)
    term_ = columns_of(*spec.type, effect.given, effect.shape);
  else
    viscous_ = spec.drive_term == kDriveTermSpecs[std::size_t(DriveTerm::viscous)].name;
}

Eigen::Vector2d EffectLaw::units(const model::JointMoment& now) const {
  if (!term_) return {drive_unit(viscous_ ? DriveTerm::viscous : DriveTerm::coulomb, now), 0};
  return {term_->at(0, now), term_->count() > 1 ? term_->at(1, now) : 0};
}

const JointEffectSpec* known_spec(const std::string& id) {
  for (const JointEffectSpec& spec : joint_effect_specs())
    if (id == spec.id) return &spec;
  return nullptr;
}

const JointEffectSpec& JointEffect::spec() const {
  if (const JointEffectSpec* spec = known_spec(id)) return *spec;
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
  if (spec.has_shape()) e.shape = yaml.number(spec.shape_name, Range::positive());
  if (spec.type)
    for (const ParameterSpec& p : spec.type->parameters)
      if (p.absent) e.given[p.name] = yaml.number_or(p.name, *p.absent, p.range);
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
  if (spec.has_shape()) text += fmt::format(", {}: {:.8g}", spec.shape_name, effect.shape);
  if (spec.type)
    for (const ParameterSpec& p : spec.type->parameters)
      if (p.absent && effect.given.has(p.name) && effect.given.at(p.name) != *p.absent)
        text += fmt::format(", {}: {:.8g}", p.name, effect.given.at(p.name));
  return text + "}";
}

Eigen::ArrayXd way_since_reversal(const Eigen::VectorXd& speed, double interval) {
  Eigen::ArrayXd way(speed.size());
  double sum = INFINITY, before = 0, direction = 0;
  for (Eigen::Index k = 0; k < way.size(); ++k) {
    const double v = speed[k];
    const bool turned = v * direction < 0;
    const double part = v * before < 0 ? v / (v - before) : 1;  // of the interval, since it turned
    sum = (turned ? 0 : sum + std::fabs(before) * interval / 2) + part * std::fabs(v) * interval / 2;
    if (v != 0) direction = v;
    before = v;
    way[k] = sum;
  }
  return way;
}

Eigen::MatrixXd effect_columns(const JointEffect& effect, const ArmMotion& m, std::size_t joint,
                               const Eigen::VectorXd& load) {
  const auto j = Eigen::Index(joint);
  const JointEffectSpec& spec = effect.spec();
  const EffectLaw law(effect);
  Eigen::ArrayXd way = Eigen::ArrayXd::Zero(m.q.rows());
  if (spec.shape == EffectShape::distance) way = way_since_reversal(m.motor_v.col(j), m.interval);
  Eigen::MatrixXd out(m.q.rows(), spec.columns);
  for (Eigen::Index k = 0; k < out.rows(); ++k)
    out.row(k) = law.units({0, m.q(k, j), m.motor_v(k, j), m.sign(k, j), load[k], way[k]}).head(spec.columns);
  return out;
}

}  // namespace backlash::arm
