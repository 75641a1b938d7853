// SPDX-License-Identifier: BSD-3-Clause
#include "change_effects.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/model/weight_term.h"

namespace backlash::changes {
namespace {

constexpr double kLeastOrder = 2;  // 1/rad, of waves: below are gravity and eccentric encoders. Choice
constexpr double kLeastFrictionOrder = 1;            // 1/rad, of position-dependent friction. Choice
constexpr double kMostOrder = 80, kOrderStep = 0.5;  // 1/rad. Choice
constexpr double kMostFrictionOrder = 12;            // 1/rad. Choice
constexpr double kFluctuationSpeeds[] = {0.4, 0.7, 1, 1.4, 1.8, 2.3};  // - of the rms speed. Choice
constexpr int kRotorShares = 10;  // shares of one inertia that are tried, as far from each other. Choice
const char* const kSlip = "encoder_slip";

double direction(const Moment& m, double) {
  return m.direction;
}
double speed(const Moment& m, double) {
  return m.speed;
}
double acceleration(const Moment& m, double) {
  return m.acceleration;
}
/// A joint stands s less than its encoder shows, per s: only gravity shows that.
double load_elsewhere(const Moment& m, double s) {
  return s == 0 ? -m.load_slope : ((std::cos(s) - 1) * m.weight - std::sin(s) * m.load_slope) / s;
}
/// The recorded torque is larger than before.
double whole_torque(const Moment& m, double) {
  return m.torque;
}
/// The recorded torque is that of s later, per s: Taylor's series.
double torque_ahead(const Moment& m, double s) {
  return m.torque_rates[0] + s / 2 * m.torque_rates[1] + s * s / 6 * m.torque_rates[2];
}
double mesh_load(const Moment& m, double) {
  return m.mesh;
}
double less_one(const Moment&, double) {
  return -1;
}

/// Values that every rig file declares, and sensors. What they are measured by may have another name.
struct Declared {
  const char *name, *unit, *value;
  double (*column)(const Moment&, double shape);
  bool of_load = false;
  bool of_size = false;
};
const Declared kOfTorque[] = {{"motor_coulomb", "N m", "motor_coulomb", direction},
                              {"motor_viscous", "N m s/rad", "motor_viscous", speed},
                              {"motor_inertia", "kg m^2", "motor_inertia", acceleration},
                              {"load_inertia", "kg m^2", "load_inertia", acceleration},
                              {"motor_torque_gain", "-", "gain", whole_torque, true},
                              {kSlip, "rad", "offset", load_elsewhere, true, true}};
const Declared kOfDeflection[] = {{"mesh_stiffness", "rad/(N m)", "compliance", mesh_load},
                                  {kSlip, "rad", "offset", less_one},
                                  {"encoder_skew", "s", "encoder_skew", speed}};

/// A delay of the torque calibrates a channel: its term has no column of its own.
const Declared& delay_of_torque() {
  static const model::TermType& type = model::term_type_that(
      [](const model::TermType& t) { return t.calibrates == model::Calibrates::torque_delay; });
  static const Declared delay = {type.id.c_str(), "s",  type.search->strength.c_str(),
                                 torque_ahead,    true, true};
  return delay;
}

ChangeEffect effect_of(const Declared& d) {
  ChangeEffect e{d.name};
  e.law = [column = d.column](double shape) {
    return std::vector<OfMoment>{[=](const Moment& m) { return column(m, shape); }};
  };
  e.count = 1;
  e.of_load = d.of_load, e.of_size = d.of_size;
  return e;
}

const Declared* declared(const std::string& id) {
  for (const Declared& d : kOfTorque)
    if (id == d.name) return &d;
  for (const Declared& d : kOfDeflection)
    if (id == d.name) return &d;
  return id == delay_of_torque().name ? &delay_of_torque() : nullptr;
}

model::JointMoment joint_moment(const Moment& m) {
  return {m.time, m.position, m.speed, m.direction, m.load, m.way, m.side()};
}

std::vector<OfMoment> columns_of(model::TermColumns term) {
  const auto shared = std::make_shared<const model::TermColumns>(std::move(term));
  std::vector<OfMoment> all;
  for (std::size_t i = 0; i < shared->count(); ++i)
    all.emplace_back([shared, i](const Moment& m) { return shared->at(i, joint_moment(m)); });
  return all;
}

/// With each value of its shape; of waves all orders.
std::vector<ChangeEffect> effects_of(const model::SearchedTerm& term) {
  const model::TermType& type = *term.type;
  const std::optional<ParameterSpec> shape = model::searched_shape(type);
  const auto made = [type = &type, given = term.given, shape](double value) {
    ParameterValues all = given;
    if (shape) all[shape->name] = value;
    return model::TermColumns(*type, all);
  };
  const model::TermColumns any = made(1);
  ChangeEffect e{type.id};
  e.law = [made](double value) { return columns_of(made(value)); };
  e.count = any.count();
  e.type = &type;
  e.of_load = any.follows_load();
  e.rubs = any.rubs();
  e.ramp = any.follows_time();
  for (const model::TermShape& s : type.search->shapes)
    if (!s.refined) e.variant += " " + s.name + " " + to_text(term.given.at(s.name));
  if (!shape) return {e};
  std::vector<double> values = term.shapes;
  if (model::has_order(type))
    for (double n = e.least_order(); n <= (e.rubs ? kMostFrictionOrder : kMostOrder); n += kOrderStep)
      values.push_back(n);
  std::vector<ChangeEffect> all(values.size(), e);
  for (std::size_t i = 0; i < values.size(); ++i) all[i].shape = values[i];
  return all;
}

/// Torque of the load that fluctuates from the speed w0 on, faster than the record shows, by as much per
/// speed as each moment says: the law of the term is homogeneous in torques.
std::optional<ChangeEffect> fluctuating(const ChangeEffect& effect, double w0) {
  if (!effect.of_load || !effect.rubs) return std::nullopt;
  const auto term = std::make_shared<const model::TermColumns>(
      *effect.type, ParameterValues{{"fluctuation", 1}, {"fluctuation_speed", w0}});
  ChangeEffect e = effect;
  e.shape = w0;
  e.law = [term](double) {
    return std::vector<OfMoment>{[term](const Moment& m) {
      model::JointMoment scaled = joint_moment(m);
      if (m.fluctuation > 0) scaled.load /= m.fluctuation;
      return m.fluctuation > 0 ? m.fluctuation * term->at(0, scaled) : m.direction * std::fabs(m.load);
    }};
  };
  return e;
}

/// Friction of the load of one inertia of which this share is the motor's rotor.
ChangeEffect with_rotor(const ChangeEffect& effect, double share) {
  ChangeEffect e = effect;
  e.rotor_share = share;
  e.variant += " rotor " + to_text(share);
  e.law = [law = effect.law, share](double shape) {
    std::vector<OfMoment> all = law(shape);
    for (OfMoment& f : all)
      f = [share, of_load = f](const Moment& m) {
        Moment less = m;
        less.load -= share * (m.load - m.weight);
        return of_load(less);
      };
    return all;
  };
  return e;
}

/// What grows linearly from the onset on, as another effect is called that does so.
ChangeEffect ramp_of(const ChangeEffect& effect, const ChangeEffect& called) {
  ChangeEffect e = effect;
  e.id = called.id;
  e.type = called.type;
  e.law = [law = effect.law](double shape) {
    std::vector<OfMoment> both = law(shape);
    both.emplace_back([first = both.front()](const Moment& m) { return first(m) * m.time; });
    return both;
  };
  e.count = 2;
  e.ramp = true;
  return e;
}

}  // namespace

bool ChangeEffect::has_scale() const {
  return type && shape > 0 && !has_order() && !of_load;
}

double ChangeEffect::least_order() const {
  return rubs ? kLeastFrictionOrder : kLeastOrder;
}

Eigen::Index ChangeEffect::freedom() const {
  return static_cast<Eigen::Index>(ramp ? 1 : count) +
         (at_place()                   ? 2
          : has_order() || has_scale() ? 1
                                       : 0) +
         (rotor_share > 0 ? 1 : 0);
}

std::string ChangeEffect::name() const {
  if (at_place()) return id + " at " + to_text(shape);
  return shape > 0 && !of_size ? id + " " + to_text(shape) + variant : rotor_share > 0 ? id + variant : id;
}

std::vector<ChangeEffect> change_effects(const MotionSampling& sampling) {
  const bool torque = sampling.channel == ChangeChannel::torque;
  std::vector<ChangeEffect> all;
  const auto add_declared = [&](const char* name) { all.push_back(effect_of(*declared(name))); };
  if (torque) {
    add_declared("motor_coulomb");
    add_declared("motor_viscous");
    // What is carried or dropped moves with the load.
    add_declared(sampling.mesh ? "load_inertia" : "motor_inertia");
    if (!sampling.chain) add_declared("motor_torque_gain");
    if (!sampling.chain) add_declared(delay_of_torque().name);
    if (!sampling.mesh && !sampling.chain) add_declared(kSlip);
  } else {
    for (const Declared& d : kOfDeflection) all.push_back(effect_of(d));
  }
  model::MotionRange range;
  range.torque = range.duration = 1, range.speed = sampling.speed;
  for (const model::SearchedTerm& term :
       model::searched_terms(torque ? model::ShownIn::torque : model::ShownIn::deflection, range)) {
    const bool weight = term.type->id == model::weight_term();
    if (weight && sampling.chain) continue;  // an effect of the chain
    const std::vector<ChangeEffect> effects = effects_of(term);
    if (effects.front().ramp) {
      all.push_back(ramp_of(all.front(), effects.front()));
      continue;
    }
    all.insert(all.end(), effects.begin(), effects.end());
    if (weight) all.push_back(*with_inertia(all.back()));
    if (effects.front().id == "backlash") all.push_back(ramp_of(effects.front(), effects.front()));
    for (const double share : kFluctuationSpeeds)
      if (const auto e = fluctuating(effects.front(), share * sampling.speed)) all.push_back(*e);
    if (effects.front().of_load && effects.front().rubs && !sampling.mesh && !sampling.chain)
      for (int i = 1; i <= kRotorShares; ++i)
        all.push_back(with_rotor(effects.front(), double(i) / kRotorShares));
  }
  return all;
}

std::optional<ChangeEffect> with_inertia(const ChangeEffect& effect) {
  if (!effect.type || effect.type->id != model::weight_term() || effect.count != 2) return std::nullopt;
  ChangeEffect e = effect;
  e.law = [law = effect.law](double shape) {
    std::vector<OfMoment> columns = law(shape);
    columns.emplace_back([](const Moment& m) { return m.acceleration; });
    return columns;
  };
  e.count = 3;
  return e;
}

std::vector<ChangeSize> change_size(const ChangeEffect& effect, const Eigen::VectorXd& values,
                                    const Eigen::MatrixXd& covariance, bool linear) {
  std::vector<ChangeSize> out;
  const auto add = [&](const std::string& name, const std::string& unit, double value, double error) {
    out.push_back({name, model::axis_unit(unit, linear), {value, error}});
  };
  if (const Declared* d = effect.type ? nullptr : declared(effect.id)) {
    add(d->value, d->unit, values[0], std::sqrt(covariance(0, 0)));
    return out;
  }
  const ParameterSpec strength = model::regressed_strength(*effect.type);
  if (values.size() == 1) {
    add(strength.name, strength.unit, values[0], std::sqrt(covariance(0, 0)));
    if (effect.of_load && effect.shape > 0) add("fluctuation_speed", "rad/s", effect.shape, effect.shape);
    if (effect.rotor_share > 0) add("rotor_share", "-", effect.rotor_share, 1.0 / kRotorShares);
    return out;
  }
  // c cos x + s sin x = A sin(x + p)
  const double amplitude = std::hypot(values[0], values[1]);
  const Eigen::Matrix2d of_wave = covariance.topLeftCorner<2, 2>();
  const Eigen::Vector2d along = values.head<2>() / amplitude, across(along[1], -along[0]);
  add(strength.name, strength.unit, amplitude, std::sqrt(along.dot(of_wave * along)));
  add("phase", "rad", std::atan2(values[0], values[1]), std::sqrt(across.dot(of_wave * across)) / amplitude);
  if (values.size() == 3) add("inertia", "kg m^2", values[2], std::sqrt(covariance(2, 2)));
  if (effect.has_order()) add("order", "1/rad", effect.shape, 0);
  return out;
}

}  // namespace backlash::changes
