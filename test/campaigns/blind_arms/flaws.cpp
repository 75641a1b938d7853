// SPDX-License-Identifier: BSD-3-Clause
#include "flaws.h"

#include <algorithm>
#include <cmath>

#include "../machines/random.h"

namespace blind_arms {
namespace {

using machines::Random;

double log_uniform(Random& random, double from, double to) {
  return std::exp(random.uniform(std::log(from), std::log(to)));
}

const char* const kEffects[] = {"cogging",
                                "position_dependent_friction",
                                "stribeck",
                                "quadratic_drag",
                                "asymmetric_viscous",
                                "load_dependent_friction",
                                "transmission_coupling"};

/// 0.02 to 0.2 of the torque that the joint's drive was drawn for.
double drawn_torque(const Arm& arm, std::size_t joint, Random& random) {
  return std::fmax(carried_weight(arm, joint), 6 * carried_inertia(arm, joint)) *
         log_uniform(random, 0.02, 0.2);
}

/// Puts it on that joint, and writes down what should be reported of it.
void put(Arm& arm, const std::string& effect, std::size_t joint, Random& random) {
  Joint& j = arm.joints[joint];
  const double torque = drawn_torque(arm, joint, random);
  Added added{effect, joint, torque, 0};
  if (effect == "cogging")
    j.cogging = {torque, added.shape = log_uniform(random, 3, 40), random.phase()};
  else if (effect == "position_dependent_friction")
    j.ripple = {added.strength = std::fmin(torque, 0.8 * j.coulomb),
                added.shape = log_uniform(random, 1.5, 15), random.phase()};
  else if (effect == "stribeck")
    j.breakaway = torque, j.breakaway_speed = added.shape = log_uniform(random, 0.05, 0.4);
  else if (effect == "quadratic_drag")
    j.drag = torque;
  else if (effect == "asymmetric_viscous")
    j.lopsided = added.strength = random.sign() * torque;
  else if (effect == "load_dependent_friction")
    j.rubbing = added.strength = log_uniform(random, 0.03, 0.2);
  else
    j.coupling = added.strength = random.sign() * log_uniform(random, 0.05, 0.3);
  if (effect == "transmission_coupling") j.coupled = (joint + 1) % arm.joints.size();
  arm.added.push_back(added);
}

bool drifts(Arm& arm, const std::string& flaw, Random& random) {
  Joint& j = arm.joints[arm.changed];
  const double torque = drawn_torque(arm, arm.changed, random);
  if (flaw == "gain") {
    j.gain = 1 + random.sign() * random.uniform(0.08, 0.2);
    arm.added.push_back({"motor_torque_gain", arm.changed, 1 / j.gain - 1, 0});
  } else if (flaw == "cable")
    j.cable = torque;
  else if (flaw == "spot")
    j.spot = 3 * torque, j.spot_place = random.uniform(j.lower, j.upper),
    j.spot_width = random.uniform(0.02, 0.15);
  else if (flaw == "drift")
    j.drift = random.uniform(0.005, 0.02);
  else if (flaw == "play")
    j.play += random.uniform(0.002, 0.01);
  else
    return false;
  return true;
}

}  // namespace

const std::vector<Kind>& flaws() {
  static const std::vector<Kind> all = {
      {"one", "an effect of one joint, which the training records do not have"},
      {"two", "two effects, of one joint or of two"},
      {"later", "an effect of the training records, and another one of the test record alone"},
      {"bent", "an effect, where links bend behind the gear, before as after"},
      {"loaded", "an effect and a payload"},
      {"gain", "a motor that gives 8 to 20 % more or less torque than it shows"},
      {"cable", "none: a cable that pulls as a spring"},
      {"spot", "none: friction in a narrow place"},
      {"drift", "none: Coulomb friction of a joint that grows by 0.5 to 2 % per second"},
      {"play", "none: more play in a joint"}};
  return all;
}

Arm arm_before(std::uint64_t seed, const std::string& flaw) {
  Arm arm = drawn_arm(seed, flaw == "bent" ? "bend" : "unchanged");
  Random random(seed, "before " + flaw);
  if (flaw == "later")
    put(arm, kEffects[random.whole(0, 6)], std::size_t(random.whole(0, int(arm.joints.size()) - 1)), random);
  return arm;
}

Arm arm_with(std::uint64_t seed, const std::string& flaw) {
  Arm arm = arm_before(seed, flaw);
  if (flaw == "loaded") {
    const Arm payload = drawn_arm(seed, "payload");
    arm.payload = payload.payload, arm.payload_centre = payload.payload_centre;
  }
  Random random(seed, "flaw " + flaw);
  if (drifts(arm, flaw, random)) return arm;
  const std::size_t effects = flaw == "two" || flaw == "later" ? 2 : 1;
  while (arm.added.size() < effects) {
    const std::string effect = kEffects[random.whole(0, 6)];
    const auto joint = std::size_t(random.whole(0, int(arm.joints.size()) - 1));
    const bool known = std::any_of(arm.added.begin(), arm.added.end(),
                                   [&](const Added& a) { return a.effect == effect && a.joint == joint; });
    if (!known) put(arm, effect, joint, random);
  }
  return arm;
}

}  // namespace blind_arms
