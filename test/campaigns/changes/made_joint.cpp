// SPDX-License-Identifier: BSD-3-Clause
#include "made_joint.h"

#include <algorithm>
#include <cmath>

namespace backlash::change_study {
namespace {

constexpr double kEncoderNoise = 2e-6, kTurn = 0.05;  // rad; N m over which the gap is crossed
constexpr double kStep = 1e-3;                        // s, of differences
constexpr double kPayloadArm = 0.5;                   // m, at which a payload hangs
constexpr double kSlow = 0.08;                        // rad/s, below which friction is more
constexpr double kPush = 1.5;                         // s
constexpr double kGain = 0.3;                         // -, by a tenth of which the smallest gain is more
constexpr double kEarth = 9.81;                       // m/s^2

double sign(double w) {
  return std::tanh(w / 0.01);
}

/// First order noise of unit variance.
class Coloured {
 public:
  Coloured(Random& random, double step, double time) : keep_(std::exp(-step / time)) {
    last_ = normal_(random);
  }
  double next(Random& random) {
    return last_ = keep_ * last_ + std::sqrt(1 - keep_ * keep_) * normal_(random);
  }

 private:
  double keep_, last_;
  std::normal_distribution<double> normal_;
};

/// Of a damaged tooth, 1 in the middle.
double bump(const Added& a, double q) {
  const double x = (q - a.place) / a.width;
  return a.flat ? (std::fabs(x) < 1 ? 1 : 0) : std::exp(-0.5 * x * x);
}

/// Bristles (Dahl 1968): friction that comes late after a reversal, -1..1.
class Bristles {
 public:
  double next(double way, double stiffness) {
    state_ += stiffness * (way - std::fabs(way) * state_);
    return state_ = std::clamp(state_, -1.0, 1.0);
  }

 private:
  double state_ = 0;
};

}  // namespace

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

double Added::growth_of(const char* kind, double t) const {
  return of(kind, t) * (t - since) / (end - since);
}

double Task::operator()(double t, int order) const {
  // q(x), x the time along the task: q' x', q'' x'^2 + q' x''
  const double u = std::clamp((t - since_) / kSlowly, 0.0, 1.0), more = times_ - 1;
  const double x = t + more * (kSlowly * u * u * u * (1 - u / 2) + std::max(0.0, t - since_ - kSlowly));
  const double speed = 1 + more * u * u * (3 - 2 * u), speeds_up = more * 6 * u * (1 - u) / kSlowly;
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const double w = 2 * M_PI * f_[i], angle = w * x + phase_ * (i + 1);
    const double position = std::sin(angle), first = w * std::cos(angle), second = -w * w * position;
    sum += amplitudes_[i] * (order == 0   ? position
                             : order == 1 ? first * speed
                                          : second * speed * speed + first * speeds_up);
  }
  return sum;
}

Joint::Joint(Random& random, const MadeOptions& made)
    : inertia(uniform(random, 0.3, 0.6)),
      viscous(uniform(random, 0.6, 1.5)),
      coulomb(uniform(random, 0.5, 1)),
      gravity(uniform(random, 1, 4)),
      warm(uniform(random, 0, 0.35)),
      cooling(uniform(random, 60, 150)),
      noise(uniform(random, 0.02, 0.06)),
      options(made),
      colour_time(uniform(random, 0.05, 0.5)),
      wander_time(uniform(random, 60, 240)),
      stribeck(random() % 2 ? uniform(random, 0.1, 0.4) : 0) {
  if (!options.two) return;
  inertia *= 3;
  motor_inertia = inertia * uniform(random, 0.1, 0.6);
  motor_coulomb = coulomb * uniform(random, 1, 3);
  backlash = uniform(random, 2e-4, 1.5e-3);
  compliance = uniform(random, 2e-5, 1e-4);
}

record::Record Joint::record(Random& random, double duration, bool cold, bool rests,
                             const Added& added) const {
  std::normal_distribution<double> white(0, noise), encoder(0, kEncoderNoise);
  Task task(random, options.cyclic && added.since < duration);
  if (added.effect == "other_task") task.change_speed(added.since, added.size);
  Bristles bristles;
  const double rate = options.sampling;
  Coloured coloured(random, 1 / rate, colour_time);
  record::Record r;
  r.name = "made";
  double stamp = 0, next_rest = rests ? uniform(random, 200, 600) : 1e300;
  for (int k = 0; k < int(duration * rate); ++k) {
    const double t = k / rate;
    const double temperature =
        1 + (cold ? warm * std::exp(-stamp / cooling) : 0) +
        options.wander * std::sin(2 * M_PI * stamp / 600 + task.phase()) +
        0.5 * options.wander * std::sin(2 * M_PI * stamp / wander_time + 2 * task.phase());
    const double late = added.of("presliding", t) *
                        (bristles.next(task(t) - task(t - 1 / rate), 1 / added.width) - sign(task(t, 1)));
    const double slip = added.of("encoder_slip", t);
    const double shown = motor(task, t, temperature, added) + (options.two ? 0 : slip);
    r.time.push_back(stamp);
    r.column(record::Channel::motor_position).push_back(shown + encoder(random));
    r.column(record::Channel::motor_torque)
        .push_back((1 + added.of("motor_torque_gain", t)) * torque(task, t, temperature, added) + late +
                   white(random) + options.coloured * noise * coloured.next(random));
    if (options.two) r.column(record::Channel::load_position).push_back(task(t) + slip + encoder(random));
    stamp += 1 / rate;
    if (t > next_rest) {  // nothing is published
      stamp += uniform(random, 20, 120);
      next_rest = t + uniform(random, 200, 600);
    }
  }
  return r;
}

model::Rig Joint::rig() const {
  model::Rig rig;
  rig.mesh.rigid = !options.two;
  rig.motor.inertia = motor_inertia;
  rig.link.inertia = inertia;
  rig.link.coulomb_friction = coulomb;
  rig.link.viscous_damping = viscous;
  return rig;
}

double Joint::value(const std::string& effect) const {
  if (effect == "motor_coulomb") return motor_coulomb + (options.two ? 0 : coulomb);
  if (effect == "friction_drift") return motor_coulomb + coulomb;
  if (effect == "motor_viscous" || effect == "load_viscous") return viscous;
  if (effect == "load_coulomb") return coulomb;
  if (effect == "gravity" || effect == "payload") return gravity;
  if (effect == "backlash" || effect == "growing_backlash") return backlash;
  if (effect == "mesh_stiffness") return compliance;
  if (effect == "motor_torque_gain") return kGain;
  return inertia;
}

/// That the load takes.
double Joint::load(const Task& task, double t, double temperature, const Added& a) const {
  const double q = task(t), w = task(t, 1);
  const double heavy = inertia + a.of("load_inertia", t) + a.of("motor_inertia", t) +
                       kPayloadArm / kEarth * a.of("payload", t);
  const double free = heavy * task(t, 2) + (gravity + a.of("gravity", t) + a.of("payload", t)) * std::sin(q);
  const double dry = a.of("load_coulomb", t) + (options.two ? 0 : a.of("motor_coulomb", t)) +
                     (options.two ? 0 : a.growth_of("friction_drift", t)) +
                     a.of("load_dependent_friction", t) * std::fabs(free);
  const double fault = a.of("local_fault", t) * (w > 0 ? a.forward : a.backward) * bump(a, q);
  const double rubs = coulomb * sign(w) * (1 + stribeck * std::exp(-w * w / (kSlow * kSlow)));
  return free + temperature * (viscous * w + rubs) +
         (a.of("load_viscous", t) + (options.two ? 0 : a.of("motor_viscous", t))) * w + dry * sign(w) +
         fault + a.of("asymmetric_coulomb", t) + a.of("cogging", t) * std::sin(a.order * q + a.phase) +
         (t < a.since + kPush ? a.of("push", t) : 0) +
         a.of("stribeck", t) * sign(w) * std::exp(-w * w / 0.1) +
         a.of("swing", t) * sign(w) * std::sin(M_PI * t) + options.wave * noise * sign(w) * std::sin(25 * q) +
         a.of("rubbed_wave", t) * sign(w) * std::sin(a.order * q + a.phase);
}

double Joint::motor(const Task& task, double t, double temperature, const Added& a) const {
  if (!options.two) return task(t);
  const double bears = load(task, t, temperature, a);
  const double bent = a.of("tooth", t) * (bears > 0 ? a.forward : -a.backward) * bump(a, task(t)) *
                      std::fabs(std::tanh(bears / kTurn));
  return task(t) +
         (backlash + a.of("backlash", t) + a.growth_of("growing_backlash", t)) / 2 *
             std::tanh(bears / kTurn) +
         (compliance + a.of("mesh_stiffness", t)) * bears + bent;
}

double Joint::torque(const Task& task, double t, double temperature, const Added& a) const {
  const double bears = load(task, t, temperature, a);
  if (!options.two) return bears;
  const double before = motor(task, t - kStep, temperature, a), now = motor(task, t, temperature, a),
               after = motor(task, t + kStep, temperature, a), w = task(t, 1);
  return bears + motor_inertia * (after - 2 * now + before) / (kStep * kStep) +
         (temperature * motor_coulomb + a.of("motor_coulomb", t) + a.growth_of("friction_drift", t)) *
             sign(w) +
         a.of("motor_viscous", t) * w;
}

}  // namespace backlash::change_study
