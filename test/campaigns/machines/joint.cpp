// SPDX-License-Identifier: BSD-3-Clause
#include "joint.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <stdexcept>

namespace machines {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kStep = 2.5e-4;  // s

struct Wanted {
  double position, speed, acceleration;
};
using Motion = std::function<Wanted(double time)>;

/// Four sines, slow and wide as a robot's test trajectory.
Motion sines(Random& random) {
  struct Part {
    double amplitude, frequency, phase;  // rad, rad/s, rad
  };
  std::vector<Part> parts;
  double reach = 0;
  for (int i = 0; i < 4; ++i) {
    const double frequency = 2 * Random::kPi * random.uniform(0.05, 0.5);
    const double amplitude = random.uniform(0.3, 1) / (frequency + 0.3);
    parts.push_back({amplitude, frequency, random.phase()});
    reach += amplitude;
  }
  const double scale = random.uniform(1.5, 2.5) / reach;
  return [parts, scale](double time) {
    Wanted w{0, 0, 0};
    for (const Part& p : parts) {
      const double angle = p.frequency * time + p.phase, a = scale * p.amplitude;
      w.position += a * std::sin(angle);
      w.speed += a * p.frequency * std::cos(angle);
      w.acceleration -= a * p.frequency * p.frequency * std::sin(angle);
    }
    return w;
  };
}

/// From place to place by the quintic that starts and ends without acceleration, with pauses.
Motion moves(Random& random, double duration) {
  struct Move {
    double start, length, from, to;  // s, s, rad, rad
  };
  auto list = std::make_shared<std::vector<Move>>();
  double time = 0, place = 0;
  while (time < duration) {
    const double next = random.uniform(-2, 2);
    const double length = std::max(0.5, std::abs(next - place) / random.uniform(0.5, 1.5));
    list->push_back({time, length, place, next});
    place = next;
    time += length + random.uniform(0.1, 0.6);
  }
  return [list](double now) {
    const auto after = std::upper_bound(list->begin(), list->end(), now,
                                        [](double t, const Move& move) { return t < move.start; });
    const Move& m = after == list->begin() ? list->front() : *(after - 1);
    const double s = std::clamp((now - m.start) / m.length, 0.0, 1.0), way = m.to - m.from;
    return Wanted{m.from + way * s * s * s * (10 - 15 * s + 6 * s * s),
                  way / m.length * 30 * s * s * (1 - s) * (1 - s),
                  way / (m.length * m.length) * 60 * s * (1 - s) * (1 - 2 * s)};
  };
}

/// Everything that acts but inertia; the load's torque is solved for, as friction may follow it.
class Mechanism {
 public:
  explicit Mechanism(const Joint& joint) : joint_(joint) {}

  double position = 0, speed = 0;

  /// What the loop knows of.
  double gravity() const {
    return joint_.gravity.amplitude == 0
               ? 0
               : joint_.gravity.amplitude * std::sin(position + joint_.gravity.phase);
  }

  void step(double current, double time) {
    const Friction& f = joint_.friction;
    const double length = joint_.friction_build_up;
    bristle_ = (bristle_ + kStep * speed / length) / (1 + kStep * std::abs(speed) / length);
    double smooth = f.viscous * speed + f.quadratic * speed * std::abs(speed);
    if (speed > 0) smooth += f.asymmetric_viscous * speed;
    double limit =
        f.coulomb * (1 + f.position.value(position) + f.drift * time + joint_.friction_swing.value(time));
    if (f.stribeck != 0) limit += f.stribeck * std::exp(-std::pow(speed / f.stribeck_speed, 2));
    const double rest = current - joint_.cogging.value(position) - smooth - std::max(0.0, limit) * bristle_;
    // L + share |L| z = rest; 1 + share z > 0
    const double load = rest / (1 + f.load_dependent * bristle_ * (rest < 0 ? -1 : 1));
    const double taken_up = time >= joint_.more_at ? joint_.more_gravity * std::sin(position) : 0;
    speed += kStep * (load - gravity() - taken_up - joint_.outside.value(time)) / joint_.inertia;
    position += kStep * speed;
  }

 private:
  const Joint& joint_;
  double bristle_ = 0;  // -1 to 1
};

double rounded(double value, double step) {
  return std::round(value / step) * step;
}

Wave draw_wave(Random& random, double amplitude, double first, double last) {
  return {amplitude, random.uniform(first, last), random.phase()};
}

Swings draw_swings(Random& random, int count, double largest, double first, double last) {
  Swings swings;
  for (int i = 0; i < count; ++i) {
    const double amplitude = count == 1 ? largest : random.uniform(0.2, 1) * largest;
    swings.sines.push_back(
        {amplitude, 2 * Random::kPi * first * std::pow(last / first, random.uniform(0, 1)), random.phase()});
  }
  return swings;
}

Json describe(const char* equation, const Wave& wave) {
  return {{"equation", equation}, {"A", wave.amplitude}, {"n", wave.order}, {"p", wave.phase}};
}

}  // namespace

double Swings::value(double time) const {
  double sum = 0;
  for (const Sine& s : sines) sum += s.amplitude * std::sin(s.frequency * time + s.phase);
  return sum;
}

const std::vector<JointEffect>& joint_effects() {
  static const std::vector<JointEffect> effects{
      {"gravity", false,
       [](Random& random, double strength, double, Joint& joint) {
         joint.gravity = {strength * random.uniform(2, 8), random.uniform(-0.5, 0.5)};
         return Json{{"equation", "A*sin(q+p), opposing"},
                     {"A", joint.gravity.amplitude},
                     {"p", joint.gravity.phase}};
       }},
      {"load_dependent_friction", false,
       [](Random& random, double strength, double, Joint& joint) {
         joint.friction.load_dependent = strength * random.uniform(0.08, 0.25);
         return Json{{"equation", "A*abs(L)*sign(w), L = torque that the load takes"},
                     {"A", joint.friction.load_dependent}};
       }},
      {"stribeck", false,
       [](Random& random, double strength, double, Joint& joint) {
         Friction& f = joint.friction;
         f.stribeck = strength * random.uniform(0.2, 0.5) * f.coulomb;
         f.stribeck_speed = random.uniform(0.05, 0.2);
         return Json{{"equation", "A*exp(-(w/ws)^2)*sign(w)"}, {"A", f.stribeck}, {"ws", f.stribeck_speed}};
       }},
      {"quadratic_drag", false,
       [](Random& random, double strength, double, Joint& joint) {
         joint.friction.quadratic = strength * random.uniform(0.3, 1);
         return Json{{"equation", "A*w*abs(w)"}, {"A", joint.friction.quadratic}};
       }},
      {"asymmetric_viscous", false,
       [](Random& random, double strength, double, Joint& joint) {
         joint.friction.asymmetric_viscous = strength * random.uniform(0.3, 0.8);
         return Json{{"equation", "A*w where w > 0"}, {"A", joint.friction.asymmetric_viscous}};
       }},
      {"position_dependent_friction", false,
       [](Random& random, double strength, double, Joint& joint) {
         Wave& wave = joint.friction.position;
         wave = draw_wave(random, strength * random.uniform(0.2, 0.5), 1, 12);
         return describe("Coulomb*(1 + A*sin(n*q+p))", wave);
       }},
      {"cogging", false,
       [](Random& random, double strength, double, Joint& joint) {
         joint.cogging = draw_wave(random, strength * random.uniform(0.1, 0.4), 4, 60);
         return describe("A*sin(n*q+p), opposing", joint.cogging);
       }},
      {"friction_drift", false,
       [](Random& random, double strength, double duration, Joint& joint) {
         joint.friction.drift = strength * random.sign() * random.uniform(0.2, 0.5) / duration;
         return Json{{"equation", "Coulomb*(1 + A*t)"}, {"A", joint.friction.drift}};
       }},
      {"outside_torque", true,
       [](Random& random, double strength, double, Joint& joint) {
         joint.outside = draw_swings(random, 1, strength * random.uniform(0.2, 0.6), 0.1, 1);
         return Json{{"equation", "A*sin(2*pi*f*t), opposing"}, {"A", joint.outside.sines[0].amplitude}};
       }},
      {"wandering_torque", true,
       [](Random& random, double strength, double, Joint& joint) {
         const double largest = strength * random.uniform(0.1, 0.3);
         joint.outside = draw_swings(random, 12, largest, 0.02, 3);
         return Json{{"equation", "twelve sines of the time, opposing"}, {"A", largest}};
       }},
      {"friction_swing", true,
       [](Random& random, double strength, double, Joint& joint) {
         joint.friction_swing = draw_swings(random, 1, strength * random.uniform(0.2, 0.5), 0.03, 0.1);
         return Json{{"equation", "Coulomb*(1 + A*sin(2*pi*f*t))"},
                     {"A", joint.friction_swing.sines[0].amplitude}};
       }},
      {"payload_step", true,
       [](Random& random, double strength, double duration, Joint& joint) {
         joint.more_gravity = strength * random.uniform(1, 3);
         joint.more_at = random.uniform(0.2, 0.4) * duration;
         return Json{
             {"equation", "A*sin(q) from t on, opposing"}, {"A", joint.more_gravity}, {"t", joint.more_at}};
       }},
  };
  return effects;
}

Joint draw_joint(Random& random, double rate) {
  Joint joint;
  joint.inertia = random.uniform(0.3, 0.9);
  joint.friction.viscous = random.uniform(0.5, 1.5);
  joint.friction.coulomb = random.uniform(0.5, 1.5);
  const double rates[] = {100, 125, 250, 500};
  const double drawn = rates[random.whole(0, 3)];
  joint.rate = rate > 0 ? rate : drawn;
  joint.noise = random.uniform(0.01, 0.05);
  joint.jitter = random.chance(0.5) ? 0.2 : 0;
  return joint;
}

std::vector<JointRow> run_joint(const Joint& joint, bool in_moves, double duration, Random& random) {
  const Motion wanted = in_moves ? moves(random, duration) : sines(random);
  const double own = 2 * Random::kPi * 4, damping = 0.8;  // rad/s, -: of the loop
  const double stiffness = joint.inertia * own * own, speed_gain = 2 * damping * joint.inertia * own;
  Joint met = joint;  // what swings in time is met at another moment of it
  for (Swings* swings : {&met.outside, &met.friction_swing})
    for (Swings::Sine& sine : swings->sines) sine.phase += random.phase();
  Mechanism mechanism(met);
  mechanism.position = wanted(0).position;
  std::vector<JointRow> rows;
  double current = 0, next = 0;
  for (long k = 0; double(k) * kStep < duration; ++k) {
    const double time = double(k) * kStep;
    if (time >= next - 1e-9) {
      const Wanted w = wanted(time);
      current = stiffness * (w.position - mechanism.position) + speed_gain * (w.speed - mechanism.speed) +
                joint.inertia * w.acceleration + mechanism.gravity();
      rows.push_back({time, rounded(current + joint.noise * random.normal(), joint.step),
                      rounded(mechanism.position, joint.resolution)});
      const double interval = (1 + joint.jitter * random.uniform(-1, 1)) / joint.rate;
      next = time + std::max(1.0, std::round(interval / kStep)) * kStep;
    }
    mechanism.step(current, time);
  }
  return rows;
}

void write_csv(const std::vector<JointRow>& rows, const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (file == nullptr) throw std::runtime_error("cannot write " + path);
  std::fputs("time,motor_torque,motor_position\n", file);
  for (const JointRow& row : rows)
    std::fprintf(file, "%.5f,%.4f,%.6f\n", row.time, row.current, row.position);
  if (std::fclose(file) != 0) throw std::runtime_error("cannot write " + path);
}

}  // namespace machines
