// SPDX-License-Identifier: BSD-3-Clause
#include "robot_joint.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace robot_joints {
namespace {

constexpr double kStep = 1e-5;      // s: a cycle of the wheel on its shaft has two hundred
constexpr double kLoop = 1e-3;      // s, of the controller
constexpr double kMostTorque = 80;  // N m, of the drive
constexpr double kBristle = 2e-5;   // rad, over which LuGre's friction builds up
constexpr double kBuildUp = 1e-4;   // rad/s, within which Coulomb friction turns round

struct Wanted {
  double position, speed, acceleration;
};
using Motion = std::function<Wanted(double)>;

/// Moves that start and end without acceleration (quintic), each to the next of `places`, with pauses.
Motion moves(Random& random, double duration, const std::vector<double>& places, double most_acceleration) {
  struct Move {
    double start, length, from, to;
  };
  std::vector<Move> list;
  double time = 0.3, place = places[0];
  for (std::size_t i = 1; time < duration; ++i) {
    const double next = places[i % places.size()], way = std::fabs(next - place);
    // the quintic's largest acceleration is 5.774 way / length^2
    const double length =
        std::max(0.12, std::sqrt(5.774 * way / (most_acceleration * random.uniform(0.7, 1))));
    list.push_back({time, length, place, next});
    place = next, time += length + random.uniform(0.02, 0.25);
  }
  return [list, first = places[0]](double now) {
    const auto after =
        std::upper_bound(list.begin(), list.end(), now, [](double t, const Move& m) { return t < m.start; });
    if (after == list.begin()) return Wanted{first, 0, 0};
    const Move& m = *(after - 1);
    const double s = std::clamp((now - m.start) / m.length, 0.0, 1.0), way = m.to - m.from;
    return Wanted{m.from + way * s * s * s * (10 - 15 * s + 6 * s * s),
                  way / m.length * 30 * s * s * (1 - s) * (1 - s),
                  way / (m.length * m.length) * 60 * s * (1 - s) * (1 - 2 * s)};
  };
}

Motion sines(Random& random, int count, double most_acceleration) {
  struct Part {
    double amplitude, frequency, phase;
  };
  std::vector<Part> parts;
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    const double frequency = 2 * Random::kPi * random.uniform(0.4, 2.2);
    parts.push_back({random.uniform(0.3, 1) / frequency, frequency, random.phase()});
    sum += parts.back().amplitude * frequency * frequency;
  }
  const double scale = most_acceleration / sum;
  return [parts, scale](double t) {
    Wanted w{0, 0, 0};
    const double fade = std::min(1.0, t / 0.5);  // it starts at rest, all but
    for (const Part& p : parts) {
      const double a = scale * p.amplitude * fade, x = p.frequency * t + p.phase;
      w.position += a * std::sin(x), w.speed += a * p.frequency * std::cos(x);
      w.acceleration -= a * p.frequency * p.frequency * std::sin(x);
    }
    return w;
  };
}

Motion draw_motion(const std::string& kind, Random& random, double duration, double torque, double inertia) {
  const double most = torque / inertia;
  if (kind == "pick") {
    const double a = random.uniform(-0.6, 0.2);
    return moves(random, duration, {a, a + random.uniform(0.1, 0.6)}, most);
  }
  if (kind == "via") {
    std::vector<double> places;
    for (int i = 0; i < 9; ++i) places.push_back(random.uniform(-0.6, 0.6));
    return moves(random, duration, places, most);
  }
  if (kind == "sine") return sines(random, 1, most);
  if (kind == "multi") return sines(random, random.whole(2, 4), most);
  throw std::invalid_argument("no such motion: " + kind);
}

class Plant {
 public:
  explicit Plant(const Machine& m) : m_(m), v_(m.real) {
    // In series they have the stiffness: what the shafts do not yield is left for the teeth.
    const Masses& a = m.masses;
    const double of_shafts = 1 / a.output_shaft + (a.pinion > 0 ? 1 / a.input_shaft : 0);
    shaft_ = a.output_shaft * v_.stiffness, input_ = a.input_shaft * v_.stiffness;
    teeth_ = v_.stiffness / (1 - of_shafts);
    pinion_ = a.pinion * v_.motor_inertia, rotor_ = v_.motor_inertia - pinion_;
    wheel_ = a.wheel * v_.load_inertia, load_ = v_.load_inertia - wheel_;
  }

  double qm = 0, wm = 0, qw = 0, ww = 0, ql = 0, wl = 0, through = 0;

  double shown() const { return m_.masses.flange ? qw : ql; }

  void start(double q) { qm = qp_ = qw = ql = q; }

  void step(double torque) {
    const bool separate = pinion_ > 0;
    if (!separate) qp_ = qm, wp_ = wm;
    through = teeth(qp_ - qw - wave("transmission_error"), wp_ - ww);
    const double of_rotor =
        separate ? input_ * (qm - qp_) + shaft_damping(input_, pinion_) * (wm - wp_) : through;
    const double s = shaft_ * (qw - ql) + shaft_damping(shaft_, wheel_) * (ww - wl);
    const double cogging = m_.cogging * std::sin(m_.cogging_order * qm);
    wm += kStep / rotor_ *
          (torque - motor_friction() - v_.motor_viscous * wm - cogging - undeclared() - of_rotor);
    if (separate) wp_ += kStep / pinion_ * (of_rotor - through), qp_ += kStep * wp_;
    const double at = m_.masses.flange ? ww : wl;
    const double friction = v_.load_viscous * at + v_.load_coulomb * std::clamp(at / kBuildUp, -1.0, 1.0);
    ww += kStep / wheel_ * (through - s - (m_.masses.flange ? friction : 0));
    wl += kStep / load_ *
          (s - (m_.masses.flange ? 0 : friction) - v_.gravity * std::sin(ql + v_.gravity_phase) -
           (is("gravity") ? m_.effect.size * std::sin(ql + m_.effect.phase) : 0));
    qm += kStep * wm, qw += kStep * ww, ql += kStep * wl;
  }

 private:
  static double shaft_damping(double stiffness, double inertia) {
    return 2 * 0.02 * std::sqrt(stiffness * inertia);
  }

  double motor_friction() {
    if (!m_.bristles) return v_.motor_coulomb * std::clamp(wm / kBuildUp, -1.0, 1.0);
    const double stribeck = 1 + 0.2 * std::exp(-std::pow(wm / 0.05, 2));
    bristle_ = (bristle_ + kStep * wm / kBristle) / (1 + kStep * std::fabs(wm) / kBristle);
    return v_.motor_coulomb * stribeck * bristle_;
  }

  bool is(const char* id) const { return m_.effect.id == id; }
  double wave(const char* id) const {
    return is(id) ? m_.effect.size * std::sin(m_.effect.order * qm + m_.effect.phase) : 0;
  }

  /// N m, on the motor.
  double undeclared() const {
    const double direction = std::clamp(wm / kBuildUp, -1.0, 1.0);
    double friction = wave("position_dependent_friction");
    if (is("stribeck")) friction = m_.effect.size * std::exp(-std::pow(wm / m_.effect.speed, 2));
    if (is("load_dependent_friction")) friction = m_.effect.size * std::fabs(through);
    if (is("asymmetric_coulomb")) return m_.effect.size * std::fabs(direction);
    return wave("cogging") + friction * direction;
  }

  double teeth(double x, double rate) const {
    const double gap = v_.backlash * (1 + wave("varying_backlash"));
    const double deep = std::fabs(x) - gap / 2, closing = x < 0 ? -rate : rate;
    if (deep <= 0) return 0;
    const double usual = m_.at / teeth_;  // rad
    double torque = teeth_ * deep;
    if (m_.teeth == Teeth::cubic) torque *= (1 + 0.3 * std::pow(deep / usual, 2)) / 1.3;
    if (m_.teeth == Teeth::hertz || m_.teeth == Teeth::hysteresis)
      torque *= std::pow(deep / usual, m_.power - 1);
    if (m_.teeth == Teeth::hysteresis) torque *= 1 + m_.hysteresis * std::tanh(closing / 0.005);
    torque += v_.damping * closing * std::min(1.0, deep / (0.02 * usual));
    return std::max(0.0, torque) * (x < 0 ? -1 : 1);
  }

  const Machine& m_;
  const Values& v_;
  double shaft_, input_, teeth_, rotor_, pinion_, wheel_, load_, qp_ = 0, wp_ = 0, bristle_ = 0;
};

double rounded(double value, double step) {
  return std::round(value / step) * step;
}

/// Position loop around a PI speed loop, with the speed and acceleration of the motion fed forward.
class Controller {
 public:
  Controller(const Machine& m, double bandwidth)
      : inertia_(m.real.motor_inertia + m.real.load_inertia),
        speed_(2 * Random::kPi * bandwidth),
        gravity_(m.declared.gravity),
        phase_(m.declared.gravity_phase) {}

  double torque(const Wanted& want, double q) {
    const double w = started_ ? (q - before_) / kLoop : 0;
    before_ = q, started_ = true;
    smooth_ += 0.4 * (w - smooth_);
    const double error = want.speed + 0.25 * speed_ * (want.position - q) - smooth_;
    integral_ += speed_ * speed_ * 0.1 * inertia_ * error * kLoop;
    return speed_ * inertia_ * error + integral_ + inertia_ * want.acceleration +
           gravity_ * std::sin(q + phase_);
  }

 private:
  double inertia_, speed_, gravity_, phase_, before_ = 0, smooth_ = 0, integral_ = 0;
  bool started_ = false;
};

/// Of the flanks that are pressed.
struct Count {
  long forward = 0, backward = 0, all = 0;
  int crossings = 0, side = 0;
  double most = 0;

  void see(double torque) {
    ++all, most = std::max(most, std::fabs(torque));
    const int now = torque > 0.3 ? 1 : torque < -0.3 ? -1 : 0;
    forward += now > 0, backward += now < 0;
    if (now != 0 && side != 0 && now != side) ++crossings;
    if (now != 0) side = now;
  }
};

}  // namespace

Machine draw_machine(Random& random) {
  Machine m;
  Values& r = m.real;
  const auto log_uniform = [&](double from, double to) {
    return from * std::pow(to / from, random.uniform(0, 1));
  };
  r.load_inertia = random.uniform(0.6, 1.7), r.motor_inertia = random.uniform(0.15, 1.4);
  r.stiffness = log_uniform(12000, 60000), r.backlash = log_uniform(3e-4, 3e-3);
  r.motor_viscous = random.uniform(2, 7), r.motor_coulomb = random.uniform(2, 8);
  r.load_viscous = random.uniform(0.05, 0.6), r.load_coulomb = random.uniform(0.2, 1.9);
  r.damping =
      random.uniform(0.02, 0.12) * 2 * std::sqrt(r.stiffness * std::min(r.load_inertia, r.motor_inertia));
  r.gravity = random.chance(0.25) ? random.uniform(1, 9) : 0, r.gravity_phase = random.phase();
  Values& d = m.declared = r;
  for (double* value : {&d.load_inertia, &d.motor_inertia, &d.stiffness, &d.backlash, &d.motor_viscous,
                        &d.motor_coulomb, &d.load_viscous, &d.load_coulomb, &d.damping})
    *value *= random.uniform(0.7, 1.3);
  d.gravity *= random.uniform(0.95, 1.05);
  m.teeth = Teeth(random.whole(0, 3));
  m.power = m.teeth == Teeth::hertz ? 1.5 : random.uniform(1.1, 1.4),
  m.hysteresis = random.uniform(0.03, 0.12);
  m.bristles = random.chance(0.5);
  m.cogging = random.uniform(0, 0.6), m.cogging_order = std::round(random.uniform(1, 4)) * m.ratio;
  m.gain = random.uniform(0.96, 1.04), m.offset = random.uniform(-0.5, 0.5),
  m.ripple = random.uniform(0, 0.03);
  m.lag = random.uniform(0, 1.5e-3), m.noise = random.uniform(0.1, 0.5);
  m.eccentricity = log_uniform(1e-5, 3e-4), m.eccentricity_phase = random.phase();
  m.interpolation = random.uniform(0, 1.5e-5), m.interpolation_order = std::pow(2, random.whole(7, 10));
  m.skew = random.chance(0.5) ? random.uniform(0, 4e-4) : 0;
  const double rates[] = {250, 500, 1000};
  m.rate = rates[random.whole(0, 2)];
  return m;
}

Masses draw_masses(Random& random) {
  const auto log_uniform = [&](double from, double to) {
    return from * std::pow(to / from, random.uniform(0, 1));
  };
  Masses a;
  a.pinion = random.uniform(0.05, 0.5), a.input_shaft = log_uniform(4, 12);
  a.wheel = log_uniform(0.01, 0.15), a.output_shaft = log_uniform(2.5, 8);
  a.flange = random.chance(0.6);
  return a;
}

const std::vector<std::string>& effect_ids() {
  static const std::vector<std::string> all = {"none",
                                               "cogging",
                                               "stribeck",
                                               "load_dependent_friction",
                                               "position_dependent_friction",
                                               "transmission_error",
                                               "varying_backlash",
                                               "gravity",
                                               "asymmetric_coulomb"};
  return all;
}

Machine with_effect(Machine m, const std::string& id, bool own_teeth, Random& random) {
  if (!own_teeth) m.teeth = Teeth::linear, m.bristles = false;
  m.cogging = m.offset = m.ripple = m.eccentricity = m.interpolation = m.lag = m.skew = 0, m.gain = 1;
  m.declared.gravity = m.real.gravity = 0;
  m.rate = 500;
  const double orders[] = {2, 36, m.ratio, 2 * m.ratio};
  Effect& e = m.effect;
  m.zero = random.uniform(-0.01, 0.01);
  e = {id, 0, orders[random.whole(1, 3)], random.uniform(0.03, 0.15), random.phase()};
  if (id == "cogging") e.size = random.uniform(0.4, 1.2);
  if (id == "stribeck") e.size = random.uniform(0.25, 0.7) * m.real.motor_coulomb;
  if (id == "load_dependent_friction") e.size = random.uniform(0.08, 0.25);
  if (id == "position_dependent_friction") e.size = random.uniform(0.2, 0.5) * m.real.motor_coulomb;
  if (id == "transmission_error")
    e.order = orders[random.whole(0, 2)], e.size = random.uniform(0.1, 0.5) * m.real.backlash;
  if (id == "varying_backlash") e.size = random.uniform(0.2, 0.5);
  if (id == "gravity") e.size = random.uniform(1.5, 8);
  if (id == "asymmetric_coulomb") e.size = random.uniform(0.5, 2);
  return m;
}

Run run(const Machine& m, const std::string& kind, double duration, Random& random) {
  const double torque = random.uniform(7, 22);
  const Motion motion = draw_motion(kind, random, duration, torque, m.real.load_inertia);
  Plant plant(m);
  Controller controller(m, random.uniform(12, 30));
  plant.start(motion(0).position);
  Run result;
  Count count;
  double asked = 0, given = 0, next = m.jitter / m.rate;
  const double other_zero =
      random.uniform(0, 1);  // rad, where each record has its own: of a robot that was started again
  const double zero = m.effect.id.empty() ? other_zero : m.zero;
  const long per_loop = std::lround(kLoop / kStep);
  const auto late = std::size_t(std::lround(m.skew / kStep));
  std::vector<double> loads;
  long sample = 0;
  for (long k = 0; double(k) * kStep < duration; ++k) {
    const double time = double(k) * kStep;
    if (k % per_loop == 0)
      asked = std::clamp(controller.torque(motion(time), rounded(plant.qm, m.motor_resolution)), -kMostTorque,
                         kMostTorque);
    given += m.lag > 0 ? (asked - given) * kStep / (m.lag + kStep) : asked - given;
    const double ripple = 1 + m.ripple * std::sin(6 * m.ratio * 4 * plant.qm);
    plant.step(given * ripple);
    loads.push_back(plant.shown());
    count.see(plant.through);
    if (time < next) continue;
    next = (double(++sample) + 1 + m.jitter * random.uniform(-1, 1)) / m.rate;
    const double noise = m.noise * random.normal();
    if (random.chance(m.lost)) continue;
    const double q = loads[loads.size() - 1 - std::min(late, loads.size() - 1)];
    const double shown = q + m.eccentricity * std::sin(q + m.eccentricity_phase) +
                         m.interpolation * std::sin(m.interpolation_order * q) + zero;
    result.rows.push_back({time, rounded(m.gain * asked + m.offset + noise, m.step),
                           rounded(plant.qm, m.motor_resolution), rounded(shown, m.load_resolution)});
  }
  result.crossings = count.crossings, result.most_torque = count.most;
  result.forward = double(count.forward) / double(count.all),
  result.backward = double(count.backward) / double(count.all);
  return result;
}

void jitter_stamps(Run& run, double share, double rate, Random& random) {
  constexpr double kMost = 0.49;  // of an interval: stamps stay in order
  for (Row& row : run.rows) row.time += std::clamp(share * random.normal(), -kMost, kMost) / rate;
}

}  // namespace robot_joints
