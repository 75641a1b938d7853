// SPDX-License-Identifier: BSD-3-Clause
#include "change_effects.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/model/term.h"

namespace backlash::identification {
namespace {

constexpr double kLeastOrder = 2;                    // 1/rad, of cogging: below is gravity. Choice
constexpr double kLeastFrictionOrder = 1;            // 1/rad, of position-dependent friction. Choice
constexpr double kMostOrder = 80, kOrderStep = 0.5;  // 1/rad. Choice
constexpr double kMostFrictionOrder = 12;            // 1/rad. Choice
constexpr double kFluctuationSpeeds[] = {0.4, 0.7, 1, 1.4, 1.8, 2.3};  // - of the rms speed. Choice
constexpr double kStribeckSpeeds[] = {0.1, 0.2, 0.4};                  // - of the rms speed. Choice

double direction(const Moment& m, double) {
  return m.direction;
}
double speed(const Moment& m, double) {
  return m.speed;
}
double acceleration(const Moment& m, double) {
  return m.acceleration;
}
double one(const Moment&, double) {
  return 1;
}
double speed_size(const Moment& m, double) {
  return std::fabs(m.speed);
}
double cosine(const Moment& m, double n) {
  return std::cos(n * m.position);
}
double sine(const Moment& m, double n) {
  return std::sin(n * m.position);
}
double rubbed_cosine(const Moment& m, double n) {
  return m.direction * std::cos(n * m.position);
}
double rubbed_sine(const Moment& m, double n) {
  return m.direction * std::sin(n * m.position);
}
double load_rub(const Moment& m, double) {
  return m.direction * std::fabs(m.load);
}
/// The mean of a load that fluctuates from the speed w0 on, as the term has it.
double fluctuating_load_rub(const Moment& m, double w0) {
  const double t = std::fabs(m.load), a = m.fluctuation * std::max(0.0, std::fabs(m.speed) - w0);
  return m.direction * (t >= a ? t : (t * t + a * a) / (2 * a));
}
double drag(const Moment& m, double) {
  return m.speed * std::fabs(m.speed);
}
double stribeck(const Moment& m, double ws) {
  return m.direction * std::exp(-m.speed * m.speed / (ws * ws));
}
double drift(const Moment& m, double) {
  return m.direction * m.time;
}

struct Declared {
  const char *name, *unit;
};
constexpr Declared kDeclared[] = {
    {"motor_coulomb", "N m"}, {"motor_viscous", "N m s/rad"}, {"motor_inertia", "kg m^2"}};

std::string unit_of(const std::string& id, const std::string& parameter) {
  for (const Declared& d : kDeclared)
    if (id == d.name) return d.unit;
  for (const ParameterSpec& spec : model::term_type(id).parameters)
    if (spec.name == parameter) return spec.unit;
  return "";
}

/// Name of the value of an effect with one column.
std::string value_name(const std::string& id) {
  for (const Declared& d : kDeclared)
    if (id == d.name) return id;
  return model::term_type(id).search->strength;
}

}  // namespace

bool ChangeEffect::has_order() const {
  return id == "cogging" || id == "position_dependent_friction";
}

double ChangeEffect::least_order() const {
  return id == "cogging" ? kLeastOrder : kLeastFrictionOrder;
}

std::string ChangeEffect::name() const {
  return shape > 0 ? id + " " + to_text(shape) : id;
}

std::vector<ChangeEffect> change_effects(const MotionSampling& sampling) {
  std::vector<ChangeEffect> all = {{"motor_coulomb", 0, {direction}},
                                   {"motor_viscous", 0, {speed}},
                                   {"motor_inertia", 0, {acceleration}},
                                   {"asymmetric_coulomb", 0, {one}},
                                   {"gravity", 1, {cosine, sine}},
                                   {"load_dependent_friction", 0, {load_rub}},
                                   {"asymmetric_viscous", 0, {speed_size}},
                                   {"quadratic_drag", 0, {drag}},
                                   {"friction_drift", 0, {direction, drift}, true}};
  for (const double share : kFluctuationSpeeds)
    all.push_back({"load_dependent_friction", share * sampling.speed, {fluctuating_load_rub}});
  for (const double share : kStribeckSpeeds) all.push_back({"stribeck", share * sampling.speed, {stribeck}});
  for (double n = kLeastFrictionOrder; n <= kMostFrictionOrder; n += kOrderStep)
    all.push_back({"position_dependent_friction", n, {rubbed_cosine, rubbed_sine}});
  for (double n = kLeastOrder; n <= kMostOrder; n += kOrderStep)
    all.push_back({"cogging", n, {cosine, sine}});
  return all;
}

Eigen::MatrixXd effect_columns(const SampledMotion& motion, const ChangeEffect& effect) {
  Eigen::MatrixXd out(motion.size(), static_cast<Eigen::Index>(effect.columns.size()));
  for (std::size_t i = 0; i < effect.columns.size(); ++i)
    out.col(static_cast<Eigen::Index>(i)) =
        column(motion, [&](const Moment& m) { return effect.columns[i](m, effect.shape); });
  return out;
}

std::vector<ChangeSize> change_size(const ChangeEffect& effect, const Eigen::VectorXd& values,
                                    const Eigen::MatrixXd& covariance, bool linear) {
  std::vector<ChangeSize> out;
  const auto add = [&](const std::string& name, double value, double error) {
    out.push_back({name, model::axis_unit(unit_of(effect.id, name), linear), {value, error}});
  };
  if (values.size() == 1) {
    add(value_name(effect.id), values[0], std::sqrt(covariance(0, 0)));
    if (effect.id == "stribeck") add("speed", effect.shape, effect.shape);
    if (effect.id == "load_dependent_friction" && effect.shape > 0)
      add("fluctuation_speed", effect.shape, effect.shape);
    return out;
  }
  // c cos x + s sin x = A sin(x + p)
  const double amplitude = std::hypot(values[0], values[1]);
  const Eigen::Vector2d along = values / amplitude, across(along[1], -along[0]);
  add("amplitude", amplitude, std::sqrt(along.dot(covariance * along)));
  add("phase", std::atan2(values[0], values[1]), std::sqrt(across.dot(covariance * across)) / amplitude);
  if (effect.has_order()) add("order", effect.shape, 0);
  return out;
}

}  // namespace backlash::identification
