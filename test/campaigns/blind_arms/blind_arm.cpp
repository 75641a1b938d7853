// SPDX-License-Identifier: BSD-3-Clause
#include "blind_arm.h"

#include <algorithm>
#include <cmath>

#include "../machines/random.h"

namespace blind_arms {
namespace {

using machines::Random;

constexpr double kGravity = 9.80665;      // m/s^2
constexpr double kPowerDepth = 2e-3;      // rad, at which teeth that yield by a power are the spring
constexpr double kPower = 1.35;           // of their deflection: between a spring and Hertz
constexpr double kHardeningDepth = 4e-3;  // rad, at which teeth that harden are twice the spring
constexpr double kDampedDepth = 2e-5;     // rad, over which damping comes in: no step of torque at the touch

double log_uniform(Random& random, double from, double to) {
  return std::exp(random.uniform(std::log(from), std::log(to)));
}

void draw_link(Joint& j, std::size_t i, std::size_t joints, double scale, Random& random) {
  // Most joints lift; the first may turn about the vertical, the others as they like.
  const int axis = i == 0                   ? (joints > 2 && random.chance(0.5) ? 2 : 1)
                   : random.chance(1 / 3.0) ? (random.chance(0.5) ? 2 : 0)
                                            : 1;
  j.axis = {0, 0, 0};
  j.axis[std::size_t(axis)] = random.sign();
  if (i == 0)
    j.place = {0, 0, 0.3};
  else
    j.place = {log_uniform(random, 0.15, 0.4) * scale, random.uniform(-0.1, 0.1) * scale,
               random.uniform(-0.05, 0.05) * scale};
  j.mass = log_uniform(random, 0.6, 6) * scale * scale / (1 + 0.5 * double(i));
  const double length = log_uniform(random, 0.15, 0.4) * scale, width = 0.02 * scale;
  j.centre = {length * random.uniform(0.3, 0.6), random.uniform(-0.03, 0.03) * scale,
              random.uniform(-0.03, 0.03) * scale};
  const double rod = j.mass * (length * length / 12 + width * width / 4);
  j.inertia = {j.mass * width * width, rod, rod};
}

void draw_drive(Joint& j, double inertia, double weight, Random& random) {
  const double torque = std::fmax(weight, 6 * inertia);  // N m: its gravity, or 6 rad/s^2
  j.rotor = inertia * log_uniform(random, 0.15, 1.5);
  j.coulomb = torque * log_uniform(random, 0.02, 0.12);
  j.viscous = j.coulomb * log_uniform(random, 0.2, 1);
  j.stribeck = random.uniform(0, 0.4);
  j.stribeck_speed = log_uniform(random, 0.01, 0.1);
  j.bristle = log_uniform(random, 1e-4, 1e-3);
  j.link_coulomb = torque * log_uniform(random, 0.002, 0.015);
  j.link_viscous = j.link_coulomb * log_uniform(random, 0.1, 0.6);
  const double rate = 2 * Random::kPi * log_uniform(random, 12, 40);
  j.stiffness = inertia * rate * rate;
  j.damping =
      2 * log_uniform(random, 0.02, 0.1) * std::sqrt(j.stiffness * inertia * j.rotor / (inertia + j.rotor));
  j.teeth = std::array{Teeth::spring, Teeth::power, Teeth::hardening}[std::size_t(random.whole(0, 2))];
  const double play = log_uniform(random, 4e-4, 6e-3);
  j.play = random.chance(1 / 3.0) ? 0 : play;
  j.lower = random.uniform(-2.8, -0.3);
  j.upper = j.lower + random.uniform(1.4, 3.2);
  const double loop = 2 * Random::kPi * log_uniform(random, 1.5, 4);
  j.speed_gain = 2 * (inertia + j.rotor) * loop;
  j.position_gain = 0.5 * loop;
  j.integral_gain = 0.6 * loop;
  j.torque_noise = torque * log_uniform(random, 0.001, 0.01);
  j.slow_noise = 0.3 * torque * log_uniform(random, 5e-4, 0.01);
}

void draw_encoders(Arm& arm, bool clean, Random& random) {
  for (Joint& j : arm.joints) {
    j.eccentricity = log_uniform(random, 1e-5, 3e-4) * (clean ? 0 : 1);
    j.eccentric_phase = random.phase();
    j.transmission = log_uniform(random, 1e-5, 2e-4) * (clean ? 0 : 1);
    j.transmission_phase = random.phase();
    j.transmission_order = random.whole(20, 99);
    const double zero = random.chance(0.25) ? 1 : 5e-3;  // set by hand, or with care
    j.zero = random.uniform(-zero, zero);
  }
  arm.motor_noise = log_uniform(random, 1e-6, 2e-5);
  arm.link_noise = log_uniform(random, 2e-6, 3e-5);
  arm.link_step = log_uniform(random, 5e-6, 8e-5);
  arm.late = random.chance(0.5) ? random.uniform(0, 1e-3) : 0;
  arm.rate = std::array{250.0, 500.0, 1000.0, 1000.0, 2000.0}[std::size_t(random.whole(0, 4))];
}

void declare(Arm& arm, const std::string& kind, Random& random) {
  const bool clean = kind == "clean";
  const double mass = clean ? 0 : kind == "mass" ? 0.12 : 0.02;
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    DeclaredJoint d;
    d.mass = 1 + mass * random.uniform(-1, 1);
    d.centre = 1 + 0.3 * mass * random.uniform(-1, 1);
    d.friction = random.uniform(0.7, 1.3);
    d.link_friction = log_uniform(random, 0.4, 2.5);
    d.rotor = 1 + (clean ? 0 : 0.1) * random.uniform(-1, 1);
    d.stiffness = log_uniform(random, 0.6, 1.6);
    if (clean) d.stiffness = 1;
    arm.declared.push_back(d);
  }
}

void make_wavy(Arm& arm, Random& random) {
  for (Joint& j : arm.joints)
    for (std::size_t k = 0; k < j.waves.size(); ++k) {
      j.waves[k] = log_uniform(random, 2e-5, 2e-4);
      j.wave_phases[k] = random.phase();
    }
}

/// Half of the arms hang and swing, so that gravity turns the load; the others go where the first draw says.
void choose_poses(Arm& arm, Random& random) {
  if (random.chance(0.5)) return;
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    Joint& j = arm.joints[i];
    const double down = i == 0 ? j.axis[1] * Random::kPi / 2 : 0;  // links lie along x at 0
    const double middle = down + random.uniform(-0.4, 0.4), half = random.uniform(0.7, 1.6);
    j.lower = middle - half, j.upper = middle + half;
  }
}

/// Torsion behind the gear, 15 to 60 Hz of all that the joint carries; what stands before it is a small part
/// of that, and in the URDF.
void bend(Arm& arm, Random& random) {
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    Joint& j = arm.joints[i];
    const double inertia = carried_inertia(arm, i), rate = 2 * Random::kPi * log_uniform(random, 15, 60);
    j.bend_stiffness = inertia * rate * rate;
    j.bend_damping = 2 * log_uniform(random, 0.005, 0.05) * inertia * rate;
    j.flange = inertia * log_uniform(random, 0.03, 0.1);
  }
}

void push(Arm& arm, Random& random) {
  double arms_length = arm.joints.back().centre[0];
  for (std::size_t i = 1; i < arm.joints.size(); ++i) arms_length += arm.joints[i].place[0];
  for (double time = random.uniform(4, 8); time < 300; time += random.uniform(6, 14)) {
    Push p;
    p.begin = time;
    p.end = time + random.uniform(0.5, 2);
    const double force = carried_weight(arm, 0) / arms_length * log_uniform(random, 0.05, 0.5);
    const double turn = random.phase(), height = random.uniform(-1, 1);
    p.force = {force * std::sqrt(1 - height * height) * std::cos(turn),
               force * std::sqrt(1 - height * height) * std::sin(turn), force * height};
    arm.pushes.push_back(p);
  }
}

}  // namespace

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all = {
      {"base", "masses 2 % off, encoders out of centre, transmission error, friction 30 % off"},
      {"clean", "masses, rotors and teeth as declared, encoders in centre"},
      {"mass", "masses up to 12 % off"},
      {"payload", "a payload of 0.15 to 0.8 times the last link that nobody declared"},
      {"tilted", "the base tilted by 2 to 7 degrees"},
      {"bend", "links bend behind the gear, at 15 to 60 Hz"},
      {"pushed", "pushes on the last link while the arm moves"},
      {"backwards", "the links' encoders count the other way"},
      {"wavy", "the links' encoders are wrong twice and three times per turn as well, by up to 0.2 mrad"},
      {"sound", "no play in any joint"}};
  return all;
}

const std::vector<Kind>& changes() {
  static const std::vector<Kind> all = {
      {"unchanged", "the same machine, another motion"},
      {"payload", "a payload of 0.15 to 0.8 times the last link"},
      {"friction", "Coulomb friction of one motor 1.4 to 1.8 times what it was"},
      {"tilt", "the base tilted by 2 to 7 degrees"},
      {"warm", "friction of all motors up to 25 % less"},
      {"pushed", "pushes on the last link while the arm moves"},
      {"bend", "links bend behind the gear, before as after"}};
  return all;
}

double carried_inertia(const Arm& arm, std::size_t joint) {
  double sum = 0, from = 0;
  for (std::size_t k = joint; k < arm.joints.size(); ++k) {
    const Joint& j = arm.joints[k];
    if (k > joint) from += j.place[0];
    sum += j.mass * std::pow(from + j.centre[0], 2) + j.inertia[1];
  }
  return sum;
}

double carried_weight(const Arm& arm, std::size_t joint) {
  double sum = 0, from = 0;
  for (std::size_t k = joint; k < arm.joints.size(); ++k) {
    if (k > joint) from += arm.joints[k].place[0];
    sum += arm.joints[k].mass * kGravity * (from + arm.joints[k].centre[0]);
  }
  return sum;
}

Arm drawn_arm(std::uint64_t seed, const std::string& kind) {
  Random random(seed, "arm"), poses(seed, "poses"), file(seed, "file"), more(seed, "kind");
  Arm arm;
  arm.seed = seed;
  const auto joints = std::size_t(std::array{2, 2, 3, 3, 4, 6}[std::size_t(random.whole(0, 5))]);
  arm.joints.resize(joints);
  const double scale = log_uniform(random, 0.3, 2.5);
  for (std::size_t i = 0; i < joints; ++i) draw_link(arm.joints[i], i, joints, scale, random);
  for (std::size_t i = 0; i < joints; ++i)
    draw_drive(arm.joints[i], carried_inertia(arm, i), carried_weight(arm, i), random);
  draw_encoders(arm, kind == "clean", random);
  arm.series = random.chance(0.5);
  arm.reach = random.uniform(0.5, 1);
  arm.haste = log_uniform(random, 0.5, 1.6);
  choose_poses(arm, poses);
  declare(arm, kind, file);
  const Joint& last = arm.joints.back();
  const double mass = last.mass * log_uniform(more, 0.15, 0.8);
  arm.payload_centre = {last.centre[0] * more.uniform(1, 2), more.uniform(-0.05, 0.05),
                        more.uniform(-0.05, 0.05)};
  if (kind == "payload") arm.payload = mass;
  if (kind == "tilted" || kind == "tilt") arm.tilt = more.sign() * more.uniform(0.035, 0.12);
  arm.changed = std::size_t(more.whole(0, int(joints) - 1));
  if (kind == "friction") arm.more_friction = more.uniform(1.4, 1.8);
  if (kind == "friction") arm.joints[arm.changed].coulomb *= arm.more_friction;
  if (kind == "bend") bend(arm, more);
  if (kind == "pushed") push(arm, more);
  if (kind == "wavy") make_wavy(arm, more);
  arm.backwards = kind == "backwards";
  for (Joint& j : arm.joints) {
    if (kind == "sound") j.play = 0;
    const double coulomb = more.uniform(0.75, 1), viscous = more.uniform(0.6, 0.9);
    if (kind == "warm") j.coulomb *= coulomb, j.viscous *= viscous;
  }
  return arm;
}

double teeth_torque(const Joint& joint, double twist, double rate) {
  const double depth = std::fabs(twist) - joint.play / 2, side = twist > 0 ? 1 : -1;
  if (depth <= 0) return 0;
  double torque = joint.stiffness * depth;
  if (joint.teeth == Teeth::power)
    torque = joint.stiffness * kPowerDepth * std::pow(depth / kPowerDepth, kPower);
  if (joint.teeth == Teeth::hardening) torque *= 1 + depth / kHardeningDepth;
  torque += joint.damping * side * rate * std::fmin(1, depth / kDampedDepth);
  return torque > 0 ? side * torque : 0;  // teeth do not pull
}

double teeth_energy(const Joint& joint, double twist) {
  const double depth = std::fmax(0, std::fabs(twist) - joint.play / 2);
  if (joint.teeth == Teeth::power)
    return joint.stiffness * kPowerDepth * kPowerDepth * std::pow(depth / kPowerDepth, kPower + 1) /
           (kPower + 1);
  const double spring = joint.stiffness * depth * depth / 2;
  return joint.teeth == Teeth::hardening ? spring * (1 + 2 * depth / (3 * kHardeningDepth)) : spring;
}

}  // namespace blind_arms
