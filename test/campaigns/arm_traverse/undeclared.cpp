// SPDX-License-Identifier: BSD-3-Clause
#include "undeclared.h"

#include <algorithm>
#include <cmath>

namespace backlash::geared_arm {
namespace {

using record::Channel;

/// Teeth or a flexspline that yield softly at first: stiffness `share` of the full one up to `soft` [rad].
class SoftStart : public model::ContactLaw {
 public:
  SoftStart(double stiffness, double share, double soft, double damping)
      : stiffness_(stiffness), share_(share), soft_(soft), damping_(damping) {}
  double force(double d, double rate, double) const override {
    return std::fmax(0, spring(d) + damping_ * std::fmin(1, d / soft_) * rate);
  }
  double elastic_energy(double d) const override {
    const double low = std::fmin(d, soft_);
    return stiffness_ * (share_ * low * low / 2 + (d - low) * (share_ * soft_ + (d - low) / 2));
  }
  double static_penetration(double force) const override {
    const double knee = stiffness_ * share_ * soft_;
    return force < knee ? force / (stiffness_ * share_) : soft_ + (force - knee) / stiffness_;
  }

 private:
  double spring(double d) const {
    return stiffness_ * (share_ * std::fmin(d, soft_) + std::fmax(0, d - soft_));
  }
  double stiffness_, share_, soft_, damping_;
};

double& term(GearedArm& machine, std::size_t j, arm::DriveTerm t) {
  return machine.rig.joints[j].terms[std::size_t(t)];
}

/// 1 + or - up to `most`, at least half of it.
double off(Random& random, double most) {
  return 1 + random.uniform(0.5, 1) * (random.uniform() < 0.5 ? -most : most);
}

void change_friction(GearedArm& machine, Random& random) {
  for (std::size_t j = 0; j < machine.joints.size(); ++j) {
    term(machine, j, arm::DriveTerm::coulomb) *= off(random, 0.3);
    term(machine, j, arm::DriveTerm::viscous) *= off(random, 0.3);
    machine.joints[j].link_coulomb *= off(random, 0.6);
  }
}

void add_payload(GearedArm& machine, Random& random, double least, double most) {
  arm::Body payload;  // of a forearm of a kilogram, in its outer half
  payload.mass = random.uniform(least, most);
  payload.centre = {random.uniform(0.15, 0.3), 0, 0};
  machine.rig.chain.links.back() += arm::parameters_of(payload);
}

void change_teeth(GearedArm& machine, const std::string& kind, Random& random) {
  for (GearedJoint& joint : machine.joints) {
    const auto numbers = joint.gear->contact->power_contact();
    const double k = numbers->stiffness, c = numbers->damping;
    if (kind == "stiffness") {
      const double by = random.uniform() < 0.5 ? 2 : 0.5;
      joint.gear->contact = model::make_contact_law("linear", {{"stiffness", by * k}, {"damping", by * c}});
    } else if (kind == "compliance") {
      joint.gear->contact = model::make_contact_law("linear", {{"stiffness", k / 5}, {"damping", c / 5}});
    } else if (kind == "hertz") {
      const double depth = log_uniform(random, 2e-4, 2e-3);  // rad, where it is as stiff as a spring
      joint.gear->contact = model::make_contact_law(
          "hunt_crossley", {{"stiffness", k / std::sqrt(depth)}, {"exponent", 1.5}, {"alpha", 0.5}});
    } else {
      joint.gear->contact = std::make_shared<SoftStart>(
          k, kind == "soft_start" ? random.uniform(0.05, 0.3) : random.uniform(0.3, 0.7),
          log_uniform(random, 2e-4, 2e-3), c);
    }
  }
}

struct Columns {
  std::vector<double>&torque, &position;
  const std::vector<double>&speed, &mesh;
};

/// Dry friction that builds up like a spring over `reach` [rad] (Dahl 1968) in place of the declared one.
void add_bristles(const Columns& c, double coulomb, double friction_speed, double interval, double reach) {
  double z = 0;
  for (std::size_t i = 0; i < c.torque.size(); ++i) {
    const double v = c.speed[i], rate = std::fabs(v) / reach;
    const double goal = v > 0 ? 1 : -1;
    z = goal + (z - goal) * std::exp(-rate * interval);
    c.torque[i] += coulomb * (z - std::tanh(v / friction_speed));
  }
}

/// A drive that shows its torque through a low-pass of first order of `cutoff` [Hz].
void low_pass(std::vector<double>& x, double cutoff, double interval) {
  const double share = 1 - std::exp(-2 * M_PI * cutoff * interval);
  double y = x.front();
  for (double& each : x) each = y += share * (each - y);
}

std::vector<double> later(const std::vector<double>& x, double samples) {
  std::vector<double> y = x;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double at = std::fmax(0, double(i) - samples);
    const auto k = std::min(std::size_t(at), x.size() - 2);
    y[i] = x[k] + (at - double(k)) * (x[k + 1] - x[k]);
  }
  return y;
}

void change_joint(const Columns& c, const GearedArm& machine, std::size_t joint, const std::string& kind,
                  double interval, Random& random) {
  const double coulomb = machine.rig.joints[joint].terms[std::size_t(arm::DriveTerm::coulomb)];
  const double v0 = machine.rig.identification.friction_speed;
  const double size = random.uniform(), where = random.uniform(0, 2 * M_PI);
  if (kind == "bristles") add_bristles(c, coulomb, v0, interval, 1e-4 * std::pow(30, size));
  if (kind == "filtered") low_pass(c.torque, 50 * std::pow(6, size), interval);
  if (kind == "delay") c.position = later(c.position, 0.5 + 2.5 * size);
  const double constant = kind == "constant" ? off(random, 0.05) : 1, teeth = std::round(50 + 150 * size);
  const std::vector<double> exact = c.position;
  for (std::size_t i = 0; i < c.torque.size(); ++i) {
    const double v = c.speed[i], sign = std::tanh(v / v0);
    if (kind == "stribeck")
      c.torque[i] += coulomb * (0.3 + 0.5 * size) * std::exp(-std::pow(v / 0.05, 2)) * sign;
    if (kind == "load_friction") c.torque[i] += (0.05 + 0.1 * size) * std::fabs(c.mesh[i]) * sign;
    if (kind == "cogging") c.torque[i] += coulomb * (0.05 + 0.2 * size) * std::sin(teeth * exact[i] + where);
    if (kind == "eccentric") c.position[i] += 2e-4 * size * std::sin(50 * exact[i] + where);
    c.torque[i] /= constant;
  }
}

}  // namespace

double log_uniform(Random& random, double from, double to) {
  return from * std::pow(to / from, random.uniform());
}

const std::vector<std::string>& undeclared_kinds() {
  static const std::vector<std::string> kinds{
      "nothing",    "friction",   "payload",       "heavy_payload", "constant",   "rotor",
      "stribeck",   "bristles",   "delay",         "stiffness",     "compliance", "hertz",
      "soft_start", "mild_start", "load_friction", "cogging",       "eccentric",  "coarse",
      "noise",      "rough",      "several",       "filtered"};
  return kinds;
}

void change_machine(GearedArm& machine, const std::string& kind, Random& random) {
  if (kind == "friction" || kind == "several") change_friction(machine, random);
  if (kind == "payload" || kind == "several") add_payload(machine, random, 0.05, 0.2);
  if (kind == "heavy_payload") add_payload(machine, random, 0.3, 1);
  if (kind == "rotor" || kind == "several")
    for (std::size_t j = 0; j < machine.joints.size(); ++j)
      term(machine, j, arm::DriveTerm::rotor_inertia) *= off(random, 0.15);
  if (kind == "stiffness" || kind == "compliance" || kind == "hertz" || kind == "soft_start" ||
      kind == "mild_start")
    change_teeth(machine, kind, random);
  if (kind == "several") change_teeth(machine, "stiffness", random);
  if (kind == "rough")
    for (GearedJoint& joint : machine.joints) {
      joint.excitation.controller.proportional *= random.uniform(2, 5);
      joint.excitation.controller.integral *= random.uniform(5, 20);
      joint.excitation.moves.position_gain *= random.uniform(1.5, 3);
    }
}

void change_record(std::vector<record::JointRecord>& joints, const GearedArm& machine,
                   const std::string& kind, Random& random) {
  for (std::size_t j = 0; j < joints.size(); ++j) {
    record::Record& r = joints[j].record;
    const Columns c{r.column(Channel::motor_torque), r.column(Channel::motor_position),
                    r.column(Channel::motor_velocity), r.column(Channel::output_torque)};
    const double interval = r.time[1] - r.time[0];
    if (kind == "several") {
      for (const char* each : {"constant", "stribeck", "load_friction"})
        change_joint(c, machine, j, each, interval, random);
    } else {
      change_joint(c, machine, j, kind, interval, random);
    }
  }
}

}  // namespace backlash::geared_arm
