// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/studies/tooth_impact.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace backlash::studies {
namespace {

std::vector<simulation::StateTolerance> tolerances(const Tooth& tooth, double relative,
                                                   AbsoluteTolerance kind) {
  if (kind == AbsoluteTolerance::plain) return {relative, relative};
  return {relative * tooth.depth(), relative * tooth.impact_speed()};
}

simulation::SolverSettings solver(const std::string& method, double relative_tolerance) {
  simulation::SolverSettings settings;
  settings.method = method;
  settings.relative_tolerance = relative_tolerance;
  return settings;
}

}  // namespace

double Tooth::impact_speed() const {
  return std::sqrt(2 * start_energy() / mass);
}

double Tooth::depth() const {
  const double v = impact_speed();
  return std::pow(0.5 * (exponent + 1) * mass * v * v / stiffness, 1 / (exponent + 1));
}

double Tooth::start_energy() const {
  return 0.5 * mass * speed * speed + force * distance;
}

Tooth read_tooth(const YamlReader& yaml) {
  Tooth tooth;
  tooth.name = yaml.text("name");
  tooth.mass = yaml.number("mass", Range::positive());
  tooth.stiffness = yaml.number("stiffness", Range::positive());
  tooth.exponent = yaml.number("exponent", Range::between(1, 1.5));
  tooth.alpha = yaml.number("alpha", Range::not_negative());
  tooth.gap = yaml.number("gap", Range::positive());
  tooth.force = yaml.number("force", Range::not_negative());
  tooth.distance = yaml.number("distance", Range::positive());
  tooth.speed = yaml.number("speed", Range::not_negative());
  tooth.duration = yaml.number("duration", Range::positive());
  tooth.loose = yaml.number("loose", Range::between(1e-13, 1));
  tooth.tight = yaml.number("tight", Range::between(1e-13, 1));
  if (tooth.distance > tooth.gap) yaml.fail("distance", "must be <= gap");
  if (!(tooth.start_energy() > 0)) yaml.fail("speed", "must be > 0 where no force drives the tooth");
  return tooth;
}

const char* to_string(AbsoluteTolerance kind) {
  return kind == AbsoluteTolerance::scaled ? "scaled" : "plain";
}

ToothSimulator::ToothSimulator(const Tooth& tooth, const std::string& method, double relative_tolerance,
                               AbsoluteTolerance absolute)
    : tooth_(tooth),
      law_(model::make_contact_law(
          "hunt_crossley",
          {{"stiffness", tooth.stiffness}, {"exponent", tooth.exponent}, {"alpha", tooth.alpha}})),
      integrator_(
          [this](double, const double* state, double* rate) {
            rate[0] = state[1];
            rate[1] = (tooth_.force - contact_force(state[0], state[1])) / tooth_.mass;
          },
          tolerances(tooth, relative_tolerance, absolute), solver(method, relative_tolerance)) {}

double ToothSimulator::contact_force(double x, double speed) const {
  const bool forward = x > 0;
  const double penetration = forward ? x : -x - tooth_.gap;
  if (penetration <= 0) return 0;
  const double side = forward ? 1 : -1;
  return side * law_->force(penetration, side * speed, tooth_.impact_speed());
}

double ToothSimulator::energy(double x, double speed) const {
  const double penetration = std::max(x, -x - tooth_.gap);
  const double elastic = penetration > 0 ? law_->elastic_energy(penetration) : 0;
  return 0.5 * tooth_.mass * speed * speed - tooth_.force * x + elastic;
}

ToothMotion ToothSimulator::run(int samples) {
  double state[2] = {-tooth_.distance, tooth_.speed};
  integrator_.restart(0, state, std::numeric_limits<double>::infinity());
  ToothMotion motion;
  for (int k = 0; k <= samples; ++k) {
    if (k > 0) integrator_.integrate_to(tooth_.duration * k / samples, state);
    const double force = contact_force(state[0], state[1]);
    if (k > 0)
      motion.loop_area += 0.5 * (force + motion.force.back()) * (state[0] - motion.penetration.back());
    motion.end_energy = energy(state[0], state[1]);
    motion.most_energy = std::max(motion.most_energy, motion.end_energy);
    motion.opposite = std::max(motion.opposite, -state[0] - tooth_.gap);
    motion.penetration.push_back(state[0]);
    motion.speed.push_back(state[1]);
    motion.force.push_back(force);
  }
  return motion;
}

}  // namespace backlash::studies
