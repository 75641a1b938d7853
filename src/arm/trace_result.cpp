// SPDX-License-Identifier: BSD-3-Clause
#include "trace_result.h"

#include <cmath>

#include "backlash_diagnosis/base/not_a_number.h"

namespace backlash::arm {

std::vector<FittedMotion> as_fitted(const Motions& motions, bool marked) {
  std::vector<FittedMotion> all;
  for (const ArmMotion& m : motions) all.push_back({&m, marked});
  return all;
}

std::vector<ArmParameter> effect_parameters(const FittedEffect& fitted) {
  const JointEffect& e = fitted.effect;
  const JointEffectSpec& spec = e.spec();
  const Eigen::Matrix2d c = fitted.covariance.topLeftCorner<2, 2>();
  std::vector<ArmParameter> out;
  if (spec.columns == 1) {
    out.push_back({spec.strength, spec.strength_unit, {e.values[0], std::sqrt(c(0, 0))}});
  } else {  // v0 cos x + v1 sin x = A sin(x + p)
    const double amplitude = e.values.norm();
    const Eigen::Vector2d along = e.values / amplitude, across(along[1], -along[0]);
    out.push_back({spec.strength, spec.strength_unit, {amplitude, std::sqrt(along.dot(c * along))}});
    out.push_back({"phase",
                   "rad",
                   {std::atan2(e.values[0], e.values[1]), std::sqrt(across.dot(c * across)) / amplitude}});
  }
  if (spec.type)
    for (const model::TermShape& shape : spec.type->search->shapes)
      if (!shape.refined && e.given.has(shape.name))
        out.push_back({shape.name, "-", {e.given.at(shape.name), 0}});
  if (spec.has_shape())
    out.push_back({spec.shape_name, spec.shape_unit, {e.shape, std::sqrt(fitted.covariance(2, 2))}});
  return out;
}

namespace {

constexpr double kOfUnseen = 0.5;  // of the part that no sample shows, an error; choice, tried on drawn arms

/// No machine follows the law of an effect exactly: sizes and shapes are known to a share of them, and a wave
/// to as much of a radian in the middle of the joint's motion and, which limits its order, between there and
/// its ends.
void add_error_of_law(std::vector<ArmParameter>& parameters, const FittedEffect& fitted, const ArmRig& rig,
                      double law) {
  const auto add = [](signal::Measured& m, double error) {
    m.standard_error = std::hypot(m.standard_error, error);
  };
  const JointEffectSpec& spec = fitted.effect.spec();
  const double of_size = std::hypot(law, rig.fitted ? rig.common_error : 0);
  add(parameters.front().measured, parameters.front().measured.value * of_size);
  if (!spec.has_shape()) return;
  signal::Measured& shape = parameters.back().measured;
  if (spec.shape == EffectShape::speed) {  // what it is at rest follows from faster samples, by its law
    const double x = rig.identification.slowest / shape.value, unseen = 1 - std::exp(-x * x);
    add(parameters.front().measured, parameters.front().measured.value * kOfUnseen * unseen);
    add(shape, shape.value * kOfUnseen / 2 * unseen);
  }
  if (spec.shape != EffectShape::order) return add(shape, shape.value * law);
  const double of_order = law / fitted.spread;
  add(shape, of_order);
  add(parameters[1].measured, std::hypot(law, of_order * fitted.middle));
}

/// The last effect of a joint.
ArmStep effect_step(const Candidate& c, const ArmRig& rig, double law) {
  const FittedEffect& effect = c.fit.effects[c.freedom.effects.size() - 1];
  ArmStep step;
  step.effect = effect.effect.id;
  step.joint = rig.joints[c.joint].name;
  step.other_joint = effect.effect.other;
  step.channel = step.joint + "/torque";
  step.parameters = effect_parameters(effect);
  add_error_of_law(step.parameters, effect, rig, law);
  step.gain = c.gain, step.gain_lower = c.lower, step.gain_upper = c.upper;
  step.equivalent_to = c.alike;
  return step;
}

}  // namespace

ArmStep step_of(const Candidate& named, const ArmFit& fit, const ArmRig& rig, double law) {
  Candidate c = named;
  c.fit = fit;
  if (!c.freedom.effects.empty()) return effect_step(c, rig, law);
  ArmStep step;
  step.effect = c.effect;
  step.channel = rig.joints[c.joint].name + "/torque";
  step.gain = c.gain, step.gain_lower = c.lower, step.gain_upper = c.upper;
  if (c.freedom.payload) {
    step.link = rig.chain.joints[*c.freedom.payload].link;
    const double mass = c.fit.marked().mass.value;
    const double error = rig.fitted ? std::hypot(c.fit.marked().mass.standard_error, mass * rig.common_error)
                                    : c.fit.marked().mass.standard_error;
    step.parameters.push_back({"mass", "kg", {mass, error}});
    static const char* const names[] = {"centre_x", "centre_y", "centre_z"};
    for (int i = 0; i < 3; ++i) step.parameters.push_back({names[i], "m", c.fit.marked().centre[i]});
  } else {
    step.parameters = {{"about_x", "rad", c.fit.tilt[0]}, {"about_y", "rad", c.fit.tilt[1]}};
  }
  return step;
}

ArmRig augmented_rig(const ArmRig& rig, const Candidate& taken) {
  const FitFreedom& freedom = taken.freedom;
  ArmRig out = taken.fit.rig;
  if (freedom.payload)
    out.payloads.push_back({rig.chain.joints[*freedom.payload].link, freedom.payload_sign,
                            BodyParameters(freedom.payload_sign * taken.fit.marked().payload)});
  if (freedom.tilt)
    out.chain.gravity =
        tilted(taken.fit.rig.chain.gravity, {taken.fit.tilt[0].value, taken.fit.tilt[1].value});
  for (std::size_t j = 0; j < rig.joints.size(); ++j) {
    out.joints[j].terms[std::size_t(DriveTerm::offset)] += taken.fit.marked().shifts[j];
    for (const DriveTerm t :
         {DriveTerm::coulomb, DriveTerm::viscous, DriveTerm::quadratic, DriveTerm::cubic, DriveTerm::load})
      out.joints[j].terms[std::size_t(t)] *= taken.fit.marked().friction_factors[j].value;
  }
  for (std::size_t i = 0; i < freedom.effects.size(); ++i)
    out.joints[freedom.effects[i].joint].effects.push_back(taken.fit.effects[i].effect);
  return out;
}

ArmTrace::Series series_of(const Motions& judged, const ArmFit& base, const FitFreedom& freedom,
                           const ArmFit& fit, bool marked) {
  ArmTrace::Series out;
  const std::size_t joints = fit.rig.joints.size();
  out.measured.resize(joints), out.before.resize(joints), out.after.resize(joints);
  for (const ArmMotion& m : judged) {
    const Prediction before = predict(base, {}, {&m, false}),
                     after = predict(fit, marked ? freedom : FitFreedom(), {&m, marked});
    for (std::size_t k = 0; k < m.rows.size(); ++k) {
      out.time.push_back(m.time[m.rows[k]]);
      for (std::size_t j = 0; j < joints; ++j) {
        const auto r = Eigen::Index(k), c = Eigen::Index(j);
        const bool counts = m.counts(r, c);
        out.measured[j].push_back(before.measured(r, c));
        out.before[j].push_back(counts ? before.predicted(r, c) : kNaN);
        out.after[j].push_back(counts ? after.predicted(r, c) : kNaN);
      }
    }
  }
  return out;
}

ArmTrace::Series held_series(const ArmRecord& record, record::Channel channel) {
  ArmTrace::Series out;
  out.time = record.joints.front().time;
  for (const record::Record& joint : record.joints) {
    out.measured.push_back(joint.column(channel));
    out.before.emplace_back(joint.size(), kNaN);
  }
  out.after = out.before;
  return out;
}

std::vector<double> noise_floors(const Motions& judged, const std::vector<double>& errors) {
  std::vector<double> out;
  for (std::size_t j = 0; j < errors.size(); ++j) {
    double noise = 0, count = 0, sum = 0, squares = 0;
    for (const ArmMotion& m : judged)
      for (std::size_t k = 0; k < m.rows.size(); ++k) {
        if (!m.counts(Eigen::Index(k), Eigen::Index(j))) continue;
        const double s = m.signal(Eigen::Index(m.rows[k]), Eigen::Index(j));
        count += 1, sum += s, squares += s * s;
        noise += m.noise[Eigen::Index(j)] * m.noise[Eigen::Index(j)];
      }
    out.push_back(std::isnan(errors[j]) ? kNaN : std::sqrt(noise / (squares - sum * sum / count)));
  }
  return out;
}

}  // namespace backlash::arm
