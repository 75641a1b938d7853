// SPDX-License-Identifier: BSD-3-Clause
#include "torque_rig.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace torque_rigs {
namespace {

constexpr double kStep = 1e-6;                // s: a cycle of the gear on its coupling has three hundred
constexpr double kBuildUp = 2e-3;             // rad/s, within which friction turns round
constexpr double kClosing = 1e-3;             // m/s, within which the hysteresis does
constexpr double kLowest = 7, kHighest = 12;  // Hz, of square waves

std::function<double(double)> torque_of(const std::string& kind, double level, double duration,
                                        Random& random) {
  const double frequency = random.uniform(kLowest, kHighest);
  if (kind == "square") return [=](double t) { return std::fmod(t * frequency, 1) < 0.5 ? level : -level; };
  if (kind == "sine")
    return [=](double t) { return 1.4 * level * std::sin(2 * Random::kPi * frequency * t); };
  if (kind == "binary") {
    std::vector<bool> forward;
    for (double t = 0; t < duration; t += 0.4 / frequency) forward.push_back(random.chance(0.5));
    return [=](double t) { return forward[std::size_t(t / (0.4 / frequency))] ? level : -level; };
  }
  if (kind != "multi") throw std::invalid_argument("no such torque: " + kind);
  struct Line {
    double frequency, phase;
  };
  std::vector<Line> lines;
  for (int i = 0; i < 24; ++i) lines.push_back({2 * Random::kPi * random.uniform(1, 15), random.phase()});
  return [=](double t) {
    double sum = 0;
    for (const Line& line : lines) sum += std::sin(line.frequency * t + line.phase);
    return level * std::sqrt(2.0 / 24) * sum;
  };
}

double rounded(double value, double step) {
  return std::round(value / step) * step;
}

class Plant {
 public:
  explicit Plant(const Machine& m) : m_(m), v_(m.real) {}
  double qm = 0, sensor = 0;

  void step(double torque) {
    sensor = v_.sensor_stiffness * (qm - qp_) + v_.sensor_damping * (wm_ - wp_);
    const double x = qp_ - qg_, teeth = m_.radius * (x < 0 ? -1 : 1) *
                                        force(m_.radius * std::fabs(x) - m_.backlash / 2,
                                              m_.radius * (x < 0 ? wg_ - wp_ : wp_ - wg_));
    const double cogging = m_.cogging * std::sin(m_.cogging_order * qm + m_.cogging_phase);
    wm_ += kStep / v_.motor_inertia *
           (torque - v_.motor_damping * wm_ - m_.friction * std::clamp(wm_ / kBuildUp, -1.0, 1.0) - cogging -
            sensor);
    wp_ += kStep / v_.pinion_inertia *
           (sensor - teeth - m_.pinion_friction * std::clamp(wp_ / kBuildUp, -1.0, 1.0));
    wg_ += kStep / v_.gear_inertia * (teeth - v_.output_stiffness * qg_ - v_.output_damping * wg_);
    qm += kStep * wm_, qp_ += kStep * wp_, qg_ += kStep * wg_;
  }

 private:
  double force(double depth, double rate) const {
    if (depth <= 0) return 0;
    const double loss = 1 + 1.5 * v_.loss * rate + m_.hysteresis * std::tanh(rate / kClosing);
    return v_.contact * depth * std::sqrt(depth) * std::max(0.0, loss);
  }

  const Machine& m_;
  const Values& v_;
  double wm_ = 0, qp_ = 0, wp_ = 0, qg_ = 0, wg_ = 0;
};

}  // namespace

Machine draw_machine(Random& random, bool effects) {
  Machine m;
  const auto log_uniform = [&](double from, double to) {
    return from * std::pow(to / from, random.uniform(0, 1));
  };
  Values& r = m.real;
  r.motor_inertia = log_uniform(1.5e-5, 3e-5), r.pinion_inertia = log_uniform(1.1e-5, 3e-5);
  r.gear_inertia = log_uniform(1.5e-5, 3e-5), r.motor_damping = log_uniform(0.0028, 0.008);
  r.sensor_stiffness = log_uniform(14, 42), r.sensor_damping = log_uniform(1e-4, 4e-4);
  r.output_stiffness = log_uniform(2000, 7500), r.output_damping = log_uniform(0.025, 0.08);
  r.contact = log_uniform(7e7, 4e8), r.loss = log_uniform(0.3, 1.2);
  m.radius = random.uniform(0.0115, 0.017), m.backlash = log_uniform(3e-5, 2e-4);
  Values& d = m.declared = r;
  const auto off = [&](double& value, double most) { value *= std::exp(random.uniform(-most, most)); };
  for (double* value : {&d.motor_inertia, &d.pinion_inertia, &d.gear_inertia}) off(*value, 0.3);
  off(d.sensor_stiffness, 0.17);
  for (double* value :
       {&d.motor_damping, &d.sensor_damping, &d.output_stiffness, &d.output_damping, &d.contact, &d.loss})
    off(*value, 0.5);
  m.level = random.uniform(0.038, 0.052);
  m.sensor_gain = random.uniform(0.97, 1.03), m.sensor_offset = 0.01 * m.level * random.uniform(-1, 1);
  m.sensor_noise = log_uniform(3e-4, 2e-3), m.drive_noise = log_uniform(1e-5, 8e-4);
  m.friction = random.uniform(0, 0.0025), m.resolution = log_uniform(1e-6, 1e-4);
  const double rates[] = {1000, 2000, 5000};
  m.rate = rates[random.whole(0, 2)];
  if (!effects) return m;
  if (random.chance(0.5)) m.real.loss = 0;  // nothing but hysteresis
  m.hysteresis = random.uniform(0.03, 0.09);
  m.cogging = random.uniform(0.0015, 0.004), m.cogging_order = 6 * random.whole(2, 7);
  m.cogging_phase = random.phase(), m.pinion_friction = log_uniform(5e-6, 5e-5);
  m.drive_gain = random.uniform(0.97, 1.03), m.drive_offset = 8e-4 * random.uniform(-1, 1);
  m.drive_lag = random.uniform(0, 5e-4);
  m.sensor_lag = log_uniform(3e-4, 1.2e-3);
  m.bending = random.uniform(0, 0.03), m.bending_frequency = random.uniform(120, 220);
  m.bending_damping = log_uniform(0.01, 0.05);
  m.jitter = random.chance(0.5) ? 0.05 : 0, m.lost = random.chance(0.5) ? 0.002 : 0;
  return m;
}

std::vector<Row> run(const Machine& m, const std::string& kind, double duration, Random& random) {
  const auto torque = torque_of(kind, m.level, duration, random);
  Plant plant(m);
  const double zero = random.uniform(-0.5, 0.5), w = 2 * Random::kPi * m.bending_frequency;
  double given = 0, shown = 0, bent = 0, bent_rate = 0, next = random.uniform(0, 1) / m.rate, counted = next;
  std::vector<Row> rows;
  for (long k = 0; double(k) * kStep < duration; ++k) {
    const double time = double(k) * kStep, asked = torque(time);
    given += m.drive_lag > 0 ? (asked - given) * kStep / (m.drive_lag + kStep) : asked - given;
    plant.step(given);
    shown +=
        m.sensor_lag > 0 ? (plant.sensor - shown) * kStep / (m.sensor_lag + kStep) : plant.sensor - shown;
    bent_rate += kStep * (w * w * (plant.sensor - bent) - 2 * m.bending_damping * w * bent_rate);
    bent += kStep * bent_rate;
    if (time < next) continue;
    counted += 1 / m.rate, next = counted + m.jitter * random.uniform(-1, 1) / m.rate;
    const double sensor_noise = m.sensor_noise * random.normal(),
                 drive_noise = m.drive_noise * random.normal();
    if (random.chance(m.lost)) continue;
    rows.push_back({time, m.drive_gain * given + m.drive_offset + drive_noise,
                    rounded(plant.qm + zero, m.resolution),
                    m.sensor_gain * shown + m.bending * (bent - shown) + m.sensor_offset + sensor_noise});
  }
  return rows;
}

}  // namespace torque_rigs
