// SPDX-License-Identifier: BSD-3-Clause
#include "record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>

#include "../machines/random.h"
#include "world.h"

namespace blind_arms {
namespace {

using machines::Random;

constexpr double kControl = 1e-3;     // s, between commands
constexpr double kHeld = 0.95;        // of gravity and speeds, that the controller knows
constexpr double kBegin = 0.01;       // s, of the record: the first commands are none
constexpr double kStart = 3;          // s, in which a sum of sines begins
constexpr double kSlowMemory = 0.98;  // of coloured noise, from sample to sample

struct Reference {
  double position = 0, speed = 0;
};

/// A sum of sines, or moves from pose to pose.
class Motion {
 public:
  Motion(const Arm& arm, const Joint& joint, double duration, Random& random)
      : series_(arm.series), middle_((joint.lower + joint.upper) / 2) {
    const double half = (joint.upper - joint.lower) / 2 * arm.reach;
    for (int k = 0; series_ && k < 5; ++k) {
      const double frequency = random.uniform(0.05, 0.35) * arm.haste * (k < 2 ? 0.6 : 1);
      const double amplitude = half * random.uniform(0.1, 0.45) / (k > 1 ? 1 + 6 * frequency : 1);
      sines_.push_back({amplitude, 2 * Random::kPi * frequency, random.phase()});
    }
    double time = 0.5, from = 0;
    while (!series_ && time < duration) {
      const double to = middle_ + half * random.uniform(-1, 1);
      const double length = std::fmax(0.4, std::fabs(to - from) * 1.9 / (1.2 * arm.haste));
      moves_.push_back({time, length, to});
      from = to;
      time += length + random.uniform(0.1, 0.8);
    }
  }

  Reference at(double time) const { return series_ ? on_sines(time) : on_moves(time); }

 private:
  struct Sine {
    double amplitude, rate, phase;
  };
  struct Move {
    double begin, length, to;
  };

  Reference on_sines(double time) const {
    Reference r{middle_, 0};
    for (const Sine& s : sines_) {
      r.position += s.amplitude * (std::sin(s.rate * time + s.phase) - std::sin(s.phase));
      r.speed += s.amplitude * s.rate * std::cos(s.rate * time + s.phase);
    }
    const double u = std::fmin(1, time / kStart), grown = u * u * (3 - 2 * u),
                 growing = 6 * u * (1 - u) / kStart;
    return {r.position * grown, r.speed * grown + r.position * growing};
  }
  Reference on_moves(double time) const {
    double from = 0;
    for (const Move& m : moves_) {
      if (time < m.begin) break;
      const double u = (time - m.begin) / m.length;
      if (u < 1)
        return {from + (m.to - from) * u * u * u * (10 - 15 * u + 6 * u * u),
                (m.to - from) * 30 * u * u * (1 - u) * (1 - u) / m.length};
      from = m.to;
    }
    return {from, 0};
  }

  bool series_;
  double middle_;
  std::vector<Sine> sines_;
  std::vector<Move> moves_;
};

/// P of position, PI of speed, most of gravity fed forward.
class Controller {
 public:
  Controller(const Arm& arm, std::vector<Motion> motions)
      : arm_(arm), motions_(std::move(motions)), sum_(arm.joints.size(), 0) {}

  void command(const World& world, Random& noise, std::vector<double>& torque) {
    for (std::size_t i = 0; i < torque.size(); ++i) {
      const Joint& j = arm_.joints[i];
      const Reference r = motions_[i].at(world.time());
      const double position = world.motor(i) + arm_.motor_noise * noise.normal();
      const double error = r.speed + j.position_gain * (r.position - position) - world.motor_rate(i);
      sum_[i] += error * j.integral_gain * kControl;
      torque[i] = kHeld * world.bias(i) + j.speed_gain * (error + sum_[i]);
    }
  }

 private:
  const Arm& arm_;
  std::vector<Motion> motions_;
  std::vector<double> sum_;
};

/// A row of the record, as the sensors show it.
class Sensors {
 public:
  explicit Sensors(const Arm& arm)
      : arm_(arm), slow_(arm.joints.size(), 0), passed_(std::size_t(std::lround(arm.late / kTimeStep)) + 1) {}

  void see(const World& world) {
    std::vector<double> links;
    for (std::size_t i = 0; i < slow_.size(); ++i) links.push_back(world.link(i));
    seen_.push_back(std::move(links));
    if (seen_.size() > passed_) seen_.pop_front();
  }

  std::string row(const World& world, const std::vector<double>& torque, Random& noise) {
    std::string line = fmt::format("{:.9g}", world.time());
    for (std::size_t i = 0; i < slow_.size(); ++i) {
      const Joint& j = arm_.joints[i];
      slow_[i] =
          kSlowMemory * slow_[i] + std::sqrt(1 - kSlowMemory * kSlowMemory) * j.slow_noise * noise.normal();
      const double shown = torque[i] + j.torque_noise * noise.normal() + slow_[i];
      const double motor = world.motor(i), link = seen_.front()[i];
      const double motor_shown =
          motor + arm_.motor_noise * noise.normal() +
          j.transmission * std::sin(j.transmission_order * motor + j.transmission_phase);
      double link_shown = link + j.zero + j.eccentricity * std::sin(link + j.eccentric_phase) +
                          arm_.link_noise * noise.normal();
      for (std::size_t k = 0; k < j.waves.size(); ++k)
        link_shown += j.waves[k] * std::sin(double(k + 2) * link + j.wave_phases[k]);
      link_shown = std::round(link_shown / arm_.link_step) * arm_.link_step;
      line += fmt::format(",{:.9g},{:.10g},{:.10g}", shown, motor_shown,
                          arm_.backwards ? -link_shown : link_shown);
    }
    return line;
  }

 private:
  const Arm& arm_;
  std::vector<double> slow_;
  std::deque<std::vector<double>> seen_;  // by the links' encoders, the latest last
  std::size_t passed_;
};

}  // namespace

std::string joint_name(std::size_t joint) {
  return "joint" + std::to_string(joint);
}

void make_record(const Arm& arm, double duration, int number, const std::string& path) {
  Random drawn(arm.seed, "motion " + std::to_string(number)),
      noise(arm.seed, "noise " + std::to_string(number));
  std::vector<Motion> motions;
  for (const Joint& j : arm.joints) motions.emplace_back(arm, j, duration, drawn);
  World world(arm, std::filesystem::path(path).replace_extension(".xml"));
  Controller controller(arm, std::move(motions));
  Sensors sensors(arm);
  std::vector<double> torque(arm.joints.size(), 0);
  std::ofstream out(path);
  out << "time";
  for (std::size_t i = 0; i < torque.size(); ++i)
    for (const char* channel : {"motor_torque", "motor_position", "load_position"})
      out << ',' << joint_name(i) << '/' << channel;
  out << '\n';
  const long steps = std::lround(duration / kTimeStep), control = std::lround(kControl / kTimeStep),
             sample = std::lround(1 / (arm.rate * kTimeStep));
  for (long s = 0; s < steps; ++s) {
    if (s % control == 0) controller.command(world, noise, torque);
    sensors.see(world);
    if (s % sample == 0 && world.time() > kBegin) out << sensors.row(world, torque, noise) << '\n';
    world.step(torque);
  }
  if (!out.flush()) throw std::runtime_error("cannot write " + path);
}

}  // namespace blind_arms
