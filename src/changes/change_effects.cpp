// SPDX-License-Identifier: BSD-3-Clause
#include "change_effects.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/model/term.h"

namespace backlash::changes {
namespace {

constexpr double kLeastOrder = 2;  // 1/rad, of waves: below are gravity and eccentric encoders. Choice
constexpr double kLeastFrictionOrder = 1;            // 1/rad, of position-dependent friction. Choice
constexpr double kMostOrder = 80, kOrderStep = 0.5;  // 1/rad. Choice
constexpr double kMostFrictionOrder = 12;            // 1/rad. Choice
constexpr double kFluctuationSpeeds[] = {0.4, 0.7, 1, 1.4, 1.8, 2.3};  // - of the rms speed. Choice
constexpr double kStribeckSpeeds[] = {0.1, 0.2, 0.4};                  // - of the rms speed. Choice

// Ways over which dry friction builds up after a reversal: shorter ones are over before anything counts.
constexpr double kBristles[] = {0.02, 0.05, 0.12};  // s, times the rms speed. Choice

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
double cosine(const Moment& m, double) {
  return std::cos(m.position);
}
double sine(const Moment& m, double) {
  return std::sin(m.position);
}
double load_rub(const Moment& m, double) {
  return m.direction * std::fabs(m.load);
}
/// The mean of a load that fluctuates from the speed w0 on, as the term has it.
double fluctuating_load_rub(const Moment& m, double w0) {
  const double t = std::fabs(m.load), a = m.fluctuation * std::max(0.0, std::fabs(m.speed) - w0);
  return m.direction * (t >= a ? t : (t * t + a * a) / (2 * a));
}
/// A joint stands s less than its encoder shows, per s: only gravity shows that.
double load_elsewhere(const Moment& m, double s) {
  return s == 0 ? -m.load_slope : ((std::cos(s) - 1) * m.weight - std::sin(s) * m.load_slope) / s;
}
/// The recorded torque is larger than before.
double whole_torque(const Moment& m, double) {
  return m.torque;
}
double drag(const Moment& m, double) {
  return m.speed * std::fabs(m.speed);
}
double stribeck(const Moment& m, double ws) {
  return m.direction * std::exp(-m.speed * m.speed / (ws * ws));
}
/// What Dahl's law lacks of dry friction after a reversal.
double late_friction(const Moment& m, double distance) {
  return -2 * m.direction * std::exp(-m.way / distance);
}
double drift(const Moment& m, double) {
  return m.direction * m.time;
}

double half_side(const Moment& m, double) {
  return 0.5 * m.side();
}
double half_side_drift(const Moment& m, double) {
  return 0.5 * m.side() * m.time;
}
double mesh_load(const Moment& m, double) {
  return m.mesh;
}
/// A load encoder that shows more makes the deflection smaller; so does a transmission that runs ahead.
double less_position(const Moment& m, double) {
  return -m.position;
}
double less_one(const Moment&, double) {
  return -1;
}
struct Declared {
  const char *name, *unit, *value;
};
constexpr Declared kDeclared[] = {{"motor_coulomb", "N m", "motor_coulomb"},
                                  {"motor_viscous", "N m s/rad", "motor_viscous"},
                                  {"motor_inertia", "kg m^2", "motor_inertia"},
                                  {"load_inertia", "kg m^2", "load_inertia"},
                                  {"mesh_stiffness", "rad/(N m)", "compliance"},
                                  {"encoder_skew", "s", "encoder_skew"},
                                  {"encoder_slip", "rad", "offset"},
                                  {"motor_torque_gain", "-", "gain"},
                                  {"presliding", "N m", "torque"}};

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
    if (id == d.name) return d.value;
  return model::term_type(id).search->strength;
}

ChangeEffect wave(const std::string& id, double order, const Wave& wave) {
  ChangeEffect e = {id, order, {}};
  for (const bool is_sine : {false, true})
    e.columns.emplace_back([wave, is_sine](const Moment& m, double n) {
      return wave.factor(m) * (is_sine ? std::sin(n * m.position) : std::cos(n * m.position));
    });
  e.wave = wave;
  return e;
}

/// Of the deflection: motor ahead of load.
std::vector<ChangeEffect> deflection_effects() {
  std::vector<ChangeEffect> all = {
      {"backlash", 0, {half_side}},          {"mesh_stiffness", 0, {mesh_load}},
      {"encoder_slip", 0, {less_one}},       {"encoder_skew", 0, {speed}},
      {"encoder_scale", 0, {less_position}}, {"backlash", 0, {half_side, half_side_drift}, true}};
  for (double n = kLeastOrder; n <= kMostOrder; n += kOrderStep)
    all.push_back(wave("transmission_error", n, {-1, false}));
  return all;
}

}  // namespace

bool ChangeEffect::of_load() const {
  return id == "load_dependent_friction" || id == "encoder_slip" || id == "motor_torque_gain";
}

bool ChangeEffect::rubs() const {
  return id == "load_dependent_friction" || id == "position_dependent_friction" || id == "stribeck" ||
         id == "presliding";
}

bool ChangeEffect::is_slip() const {
  return id == "encoder_slip" && !columns.empty();
}

bool ChangeEffect::has_order() const {
  return id == "cogging" || id == "position_dependent_friction" || id == "transmission_error";
}

bool ChangeEffect::has_scale() const {
  return id == "stribeck" || id == "presliding";
}

std::pair<const char*, const char*> ChangeEffect::scale() const {
  return id == "stribeck" ? std::pair("speed", "rad/s") : std::pair("distance", "rad");
}

bool may_be_external_torque(const std::string& effect) {
  return effect == "asymmetric_coulomb";
}

double ChangeEffect::least_order() const {
  return id == "position_dependent_friction" ? kLeastFrictionOrder : kLeastOrder;
}

Eigen::Index ChangeEffect::freedom() const {
  return static_cast<Eigen::Index>(ramp ? 1 : columns.size()) + (at_place()                   ? 2
                                                                 : has_order() || has_scale() ? 1
                                                                                              : 0);
}

std::string ChangeEffect::name() const {
  if (at_place()) return id + " at " + to_text(shape);
  return shape > 0 && !is_slip() ? id + " " + to_text(shape) : id;
}

std::vector<ChangeEffect> change_effects(const MotionSampling& sampling) {
  if (sampling.channel == ChangeChannel::deflection) return deflection_effects();
  // What is carried or dropped moves with the load.
  std::vector<ChangeEffect> all = {{"motor_coulomb", 0, {direction}},
                                   {"motor_viscous", 0, {speed}},
                                   {sampling.mesh ? "load_inertia" : "motor_inertia", 0, {acceleration}},
                                   {"asymmetric_coulomb", 0, {one}},
                                   {"load_dependent_friction", 0, {load_rub}},
                                   {"asymmetric_viscous", 0, {speed_size}},
                                   {"quadratic_drag", 0, {drag}},
                                   {"friction_drift", 0, {direction, drift}, true}};
  // Of an arm those are effects of the chain.
  if (!sampling.chain) {
    all.push_back({"gravity", 1, {cosine, sine}});
    all.push_back(*with_inertia(all.back()));
    all.push_back({"motor_torque_gain", 0, {whole_torque}});
  }
  if (!sampling.mesh && !sampling.chain) all.push_back({"encoder_slip", 0, {load_elsewhere}});
  for (const double share : kFluctuationSpeeds)
    all.push_back({"load_dependent_friction", share * sampling.speed, {fluctuating_load_rub}});
  for (const double share : kStribeckSpeeds) all.push_back({"stribeck", share * sampling.speed, {stribeck}});
  for (const double way : kBristles) all.push_back({"presliding", way * sampling.speed, {late_friction}});
  for (double n = kLeastFrictionOrder; n <= kMostFrictionOrder; n += kOrderStep)
    all.push_back(wave("position_dependent_friction", n, {1, true}));
  for (double n = kLeastOrder; n <= kMostOrder; n += kOrderStep)
    all.push_back(wave("cogging", n, {1, false}));
  return all;
}

std::optional<ChangeEffect> with_inertia(const ChangeEffect& effect) {
  if (effect.id != "gravity" || effect.columns.size() != 2) return std::nullopt;
  ChangeEffect e = effect;
  e.columns.emplace_back(acceleration);
  return e;
}

std::vector<ChangeSize> change_size(const ChangeEffect& effect, const Eigen::VectorXd& values,
                                    const Eigen::MatrixXd& covariance, bool linear) {
  std::vector<ChangeSize> out;
  const auto add = [&](const std::string& name, double value, double error) {
    out.push_back({name, model::axis_unit(unit_of(effect.id, name), linear), {value, error}});
  };
  if (values.size() == 1) {
    add(value_name(effect.id), values[0], std::sqrt(covariance(0, 0)));
    if (effect.id == "load_dependent_friction" && effect.shape > 0)
      add("fluctuation_speed", effect.shape, effect.shape);
    return out;
  }
  // c cos x + s sin x = A sin(x + p)
  const double amplitude = std::hypot(values[0], values[1]);
  const Eigen::Matrix2d of_wave = covariance.topLeftCorner<2, 2>();
  const Eigen::Vector2d along = values.head<2>() / amplitude, across(along[1], -along[0]);
  add("amplitude", amplitude, std::sqrt(along.dot(of_wave * along)));
  add("phase", std::atan2(values[0], values[1]), std::sqrt(across.dot(of_wave * across)) / amplitude);
  if (values.size() == 3)
    out.push_back({"inertia", model::axis_unit("kg m^2", linear), {values[2], std::sqrt(covariance(2, 2))}});
  if (effect.has_order()) add("order", effect.shape, 0);
  return out;
}

}  // namespace backlash::changes
