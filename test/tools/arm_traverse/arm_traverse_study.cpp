// SPDX-License-Identifier: BSD-3-Clause
// How often the play of an arm's joints, told by one encoder per joint, is right, unknown, or wrong: draws
// arms with play in none, one or both joints, simulates a record of each, takes the links' encoders away,
// diagnoses with a rig file that is off, and counts. Deterministic for its arguments.
#include <fmt/format.h>

#include <boost/program_options.hpp>
#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/geared_arm/simulation.h"
#include "backlash_diagnosis/geared_arm/traverse.h"
#include "support/data.h"

namespace backlash::geared_arm {
namespace {

using diagnosis::Status;
using Json = nlohmann::ordered_json;

struct Options {
  std::uint64_t seed = 1;
  int arms = 60;
  double duration = 30;  // s
  std::string out;
};

struct Drawn {
  GearedArm machine;
  std::string wrong;  // what the rig file does not know
};

double log_uniform(Random& random, double from, double to) {
  return from * std::pow(to / from, random.uniform());
}

/// What the rig file gets wrong: one thing, several, or nothing.
std::string disturb(GearedArm& machine, Random& random) {
  const double off = random.uniform(0.1, 0.2) * (random.uniform() < 0.5 ? -1 : 1);
  const int kind = int(random.uniform(0, 6));
  std::string what = "nothing";
  auto& joints = machine.rig.joints;
  if (kind == 1 || kind == 5) {
    what = "friction";
    for (std::size_t j = 0; j < joints.size(); ++j) {
      joints[j].terms[std::size_t(arm::DriveTerm::coulomb)] *= 1 + off;
      joints[j].terms[std::size_t(arm::DriveTerm::viscous)] *= 1 - off;
      machine.joints[j].link_coulomb *= 1 + 2 * off;
    }
  }
  if (kind == 2 || kind == 5) {
    what = kind == 5 ? "friction, payload" : "payload";
    arm::Body payload;  // up to a fifth of the forearm's mass, between its middle and its end
    payload.mass = std::fabs(off);
    payload.centre = {random.uniform(0.15, 0.3), 0, 0};
    machine.rig.chain.links.back() += arm::parameters_of(payload);
  }
  if (kind == 3) {
    what = "torque constant";
    joints[std::size_t(random.uniform(0, 2))].constant *= 1 + off;
  }
  if (kind == 4) {
    what = "rotor inertia";
    joints[std::size_t(random.uniform(0, 2))].terms[std::size_t(arm::DriveTerm::rotor_inertia)] *= 1 + off;
  }
  return what;
}

Drawn draw(const GearedArm& declared, Random& random) {
  Drawn drawn{declared, {}};
  GearedArm& machine = drawn.machine;
  const double centre = random.uniform() < 0.75 ? -M_PI / 2 : 0;  // a quarter is held out level
  const int where = int(random.uniform(0, 4));                    // none, shoulder, elbow, both
  const double noise = log_uniform(random, 0.3, 3);
  machine.sensors.seed = std::uint64_t(random.uniform(1, 1e9));
  machine.sensors.of(record::Channel::motor_torque).noise *= noise;
  machine.sensors.of(record::Channel::motor_position).noise *= noise;
  for (std::size_t j = 0; j < 2; ++j) {
    GearedJoint& joint = machine.joints[j];
    for (double& position : joint.excitation.moves.positions)
      position = (j == 0 ? centre : 0) + random.uniform(-1.2, 1.2);
    joint.excitation.moves.speed *= random.uniform(0.6, 1.5);
    joint.excitation.moves.acceleration *= random.uniform(0.6, 1.5);
    const bool play = where == 3 || where == int(j) + 1;
    joint.gear->backlash = play ? log_uniform(random, 5e-4, 6e-3) : 0;
    const double stiff = log_uniform(random, 0.6, 1.7);
    if (random.uniform() < 0.3)
      joint.gear->contact = model::make_contact_law(
          "hunt_crossley", {{"stiffness", stiff * (j == 0 ? 3e5 : 1e5)}, {"exponent", 1.5}, {"alpha", 0.5}});
    else
      joint.gear->contact =
          model::make_contact_law("linear", {{"stiffness", stiff * (j == 0 ? 8000 : 3000)},
                                             {"damping", log_uniform(random, 0.5, 2) * (j == 0 ? 12 : 4)}});
  }
  drawn.wrong = disturb(machine, random);
  return drawn;
}

struct Count {
  int asked = 0, told = 0, within = 0, holds = 0, none = 0, none_holds = 0, wrong_joint = 0, wrong_sure = 0;
};

/// Of a joint with play `truth`.
void count(Count& c, const diagnosis::Estimate& e, double truth) {
  ++c.asked;
  const bool holds = e.angle_lower <= truth && e.angle_upper >= truth;
  if (e.status == Status::ok || e.status == Status::below_range) {
    const double width = e.angle_upper - e.angle_lower;
    c.wrong_sure += truth < e.angle_lower - 2 * width || truth > e.angle_upper + 2 * width;
  }
  if (e.status == Status::ok) {
    ++c.told;
    c.holds += holds;
    c.within += std::fabs(e.backlash_angle - truth) <= 0.1 * truth;
    c.wrong_joint += truth == 0;
  } else if (e.status == Status::below_range) {
    ++c.none;
    c.none_holds += holds;
  }
}

void print(const char* name, const Count& c) {
  fmt::print("{:<12} {:>5} {:>6} {:>10} {:>10} {:>8} {:>10} {:>12} {:>10}\n", name, c.asked, c.told, c.within,
             c.holds, c.none, c.none_holds, c.wrong_joint, c.wrong_sure);
}

std::vector<JointTraverse> diagnosed(const GearedArm& machine, const GearedArm& declared, double duration) {
  std::vector<record::JointRecord> joints = simulate_arm(machine, duration);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    joints[j].record.column(record::Channel::load_position).clear();
    joints[j].record.column(record::Channel::load_velocity).clear();
    // The simulated drive's torque as a drive tells it whose constant is not what the file says.
    for (double& torque : joints[j].record.column(record::Channel::motor_torque))
      torque *= machine.rig.joints[j].constant;
  }
  std::vector<std::string> warnings;
  return traverses_of(declared, arm::arm_record(joints, declared.rig, "simulated"), warnings);
}

int run(const Options& o) {
  const GearedArm declared =
      load_geared_arm(test::package_file("config/two_link_arm/two_link_arm.yaml"));
  Random random(o.seed);
  Count sound, play;
  Json all = Json::array();
  for (int i = 0; i < o.arms; ++i) {
    const Drawn drawn = draw(declared, random);
    const std::vector<JointTraverse> found = diagnosed(drawn.machine, declared, o.duration);
    for (std::size_t j = 0; j < found.size(); ++j) {
      const diagnosis::Estimate& e = found[j].estimate;
      const double truth = drawn.machine.joints[j].gear->backlash;
      count(truth > 0 ? play : sound, e, truth);
      all.push_back({{"arm", i}, {"joint", declared.rig.joints[j].name}, {"truth", truth},
                     {"wrong", drawn.wrong}, {"status", diagnosis::to_string(e.status)},
                     {"value", e.backlash_angle}, {"lower", e.angle_lower}, {"upper", e.angle_upper},
                     {"misfit", found[j].misfit}, {"message", e.message}});
      std::cerr << all.back().dump() << std::endl;
    }
  }
  fmt::print("{:<12} {:>5} {:>6} {:>10} {:>10} {:>8} {:>10} {:>12} {:>10}\n", "joints", "asked", "told",
             "within 10%", "holds it", "no play", "holds it", "wrong joint", "wrong+sure");
  print("with play", play);
  print("without", sound);
  if (!o.out.empty()) std::ofstream(o.out) << all.dump(1) << '\n';
  return play.wrong_sure + sound.wrong_sure + sound.wrong_joint > 0 ? 2 : 0;
}

}  // namespace
}  // namespace backlash::geared_arm

int main(int argc, char** argv) {
  namespace po = boost::program_options;
  backlash::geared_arm::Options o;
  po::options_description options("arm_traverse_study: plays of drawn arms by one encoder per joint");
  options.add_options()("help", "this text")("seed", po::value(&o.seed), "of all that is drawn")(
      "arms", po::value(&o.arms), "how many")("duration", po::value(&o.duration), "of each record [s]")(
      "json", po::value(&o.out), "file of all answers");
  po::variables_map given;
  po::store(po::parse_command_line(argc, argv, options), given);
  po::notify(given);
  if (given.count("help") != 0u) {
    std::cout << options;
    return 0;
  }
  return backlash::geared_arm::run(o);
}
