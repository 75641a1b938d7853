// SPDX-License-Identifier: BSD-3-Clause
// How often the play of an arm's joints, estimated with one encoder per joint, is right, unknown, or wrong:
// draws arms with play in none, some or all joints, simulates a record of each, takes the links' encoders
// away, diagnoses with a rig file that does not know what undeclared.h did to the machine, and counts.
// Deterministic for its arguments.
#include <fmt/format.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/geared_arm/simulation.h"
#include "backlash_diagnosis/geared_arm/traverse.h"
#include "support/data.h"
#include "undeclared.h"

namespace backlash::geared_arm {
namespace {

using diagnosis::Status;
using record::Channel;
using Json = nlohmann::ordered_json;

struct Options {
  std::uint64_t seed = 1;
  int arms = 10, only = -1;
  double duration = 30;  // s
  std::string rig = "config/two_link_arm/two_link_arm.yaml", kind = "all", out;
};

constexpr double kPlay = 0.5;                        // probability of it in a joint
constexpr double kReach = 1.2;                       // rad, to each side of where the rig file moves
constexpr double kSmallest = 1e-4, kLargest = 6e-3;  // rad

/// Motion and play; what the file knows otherwise.
void draw(GearedArm& machine, Random& random) {
  for (GearedJoint& joint : machine.joints) {
    simulation::MoveSettings& moves = joint.excitation.moves;
    double mean = 0;
    for (const double position : moves.positions) mean += position / double(moves.positions.size());
    for (double& position : moves.positions) position = mean + random.uniform(-kReach, kReach);
    moves.speed *= random.uniform(0.6, 1.5);
    moves.acceleration *= random.uniform(0.6, 1.5);
    const double play = log_uniform(random, kSmallest, kLargest);
    joint.gear->backlash = random.uniform() < kPlay ? play : 0;
  }
}

/// As sensors show it; the links' encoders are taken away.
void measure(std::vector<record::JointRecord>& joints, const simulation::SensorsSettings& sensors,
             const std::string& kind, Random& random) {
  const double more = kind == "noise" ? random.uniform(3, 10) : log_uniform(random, 0.5, 2);
  for (record::JointRecord& joint : joints) {
    for (const Channel channel : {Channel::motor_torque, Channel::motor_position}) {
      simulation::SensorSettings settings = sensors.of(channel);
      if (kind == "coarse") settings.resolution = channel == Channel::motor_position ? 5e-5 : settings.noise;
      for (double& value : joint.record.column(channel)) {
        value += more * settings.noise * random.normal();
        if (settings.resolution > 0) value = std::round(value / settings.resolution) * settings.resolution;
      }
    }
    for (const Channel channel :
         {Channel::motor_velocity, Channel::load_position, Channel::load_velocity, Channel::output_torque})
      joint.record.column(channel).clear();
  }
}

std::vector<JointTraverse> diagnosed(GearedArm machine, const GearedArm& declared, const Options& o,
                                     const std::string& kind, Random& random) {
  const simulation::SensorsSettings sensors = machine.sensors;
  machine.sensors.channels = {};
  machine.sensors.of(Channel::motor_velocity).declared = true;
  machine.sensors.of(Channel::output_torque).declared = true;
  std::vector<record::JointRecord> joints = simulate_arm(machine, o.duration);
  change_record(joints, machine, kind, random);
  measure(joints, sensors, kind, random);
  std::vector<std::string> warnings;
  return traverses_of(declared, arm::arm_record(joints, declared.rig, "simulated"), warnings);
}

struct Count {
  int asked = 0, found = 0, within = 0, holds = 0, most = 0, most_holds = 0, wrong_sure = 0;
  double worst = 0;  // error over the interval's half width

  void add(const diagnosis::Estimate& e, double truth) {
    ++asked;
    if (e.status != Status::ok && e.status != Status::below_range) return;
    const bool in = e.angle_lower <= truth && e.angle_upper >= truth;
    const double width = e.angle_upper - e.angle_lower;
    wrong_sure += truth < e.angle_lower - 2 * width || truth > e.angle_upper + 2 * width;
    worst = std::fmax(worst, std::fabs(truth - (e.angle_lower + e.angle_upper) / 2) / (width / 2));
    (e.status == Status::ok ? found : most) += 1;
    (e.status == Status::ok ? holds : most_holds) += in;
    within += e.status == Status::ok && std::fabs(e.backlash_angle - truth) <= 0.1 * truth;
  }
};

constexpr const char* kRow =
    "{:<14} |{:>6} {:>5} {:>6} {:>6} {:>5} {:>6} {:>6} |{:>6} {:>5} {:>6} {:>6} |{:>6.1f} {:>6}\n";

void print(const std::string& name, const Count& play, const Count& sound) {
  fmt::print(kRow, name, play.asked, play.found, play.within, play.holds, play.most, play.most_holds,
             play.asked - play.found - play.most, sound.asked, sound.found, sound.most,
             sound.asked - sound.found - sound.most, std::fmax(play.worst, sound.worst),
             play.wrong_sure + sound.wrong_sure);
  std::fflush(stdout);
}

void add(Count& sum, const Count& c) {
  sum.asked += c.asked, sum.found += c.found, sum.within += c.within, sum.holds += c.holds;
  sum.most += c.most, sum.most_holds += c.most_holds, sum.wrong_sure += c.wrong_sure;
  sum.worst = std::fmax(sum.worst, c.worst);
}

Json line_of(const Options& o, const std::string& kind, int arm, const std::string& joint, double truth,
             const JointTraverse& t) {
  const diagnosis::Estimate& e = t.estimate;
  return {{"rig", o.rig},
          {"kind", kind},
          {"arm", arm},
          {"joint", joint},
          {"truth", truth},
          {"status", diagnosis::to_string(e.status)},
          {"value", e.backlash_angle},
          {"lower", e.angle_lower},
          {"upper", e.angle_upper},
          {"misfit", t.misfit},
          {"message", e.message}};
}

int run(const Options& o) {
  const GearedArm declared = load_geared_arm(test::package_file(o.rig));
  Count all_play, all_sound;
  std::ofstream out;
  if (!o.out.empty()) out.open(o.out, std::ios::app);
  fmt::print("{:<14} |{:^46} |{:^26} |\n", "", "joints with play", "joints without");
  fmt::print("{:<14} |{:>6} {:>5} {:>6} {:>6} {:>5} {:>6} {:>6} |{:>6} {:>5} {:>6} {:>6} |{:>6} {:>6}\n",
             "undeclared", "asked", "found", "<10 %", "holds", "most", "holds", "unkn.", "asked", "found",
             "most", "unkn.", "worst", "w+sure");
  const std::vector<std::string>& kinds = undeclared_kinds();
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    const std::string& kind = kinds[k];
    if (o.kind != "all" && o.kind != kind) continue;
    Count play, sound;
    for (int i = 0; i < o.arms; ++i) {
      if (o.only >= 0 && i != o.only) continue;
      Random random(o.seed, std::uint32_t(100000 * k + std::size_t(i)));
      GearedArm machine = declared;
      draw(machine, random);
      change_machine(machine, kind, random);
      const std::vector<JointTraverse> found = diagnosed(machine, declared, o, kind, random);
      for (std::size_t j = 0; j < found.size(); ++j) {
        const double truth = machine.joints[j].gear->backlash;
        (truth > 0 ? play : sound).add(found[j].estimate, truth);
        if (out) out << line_of(o, kind, i, declared.rig.joints[j].name, truth, found[j]).dump() << std::endl;
      }
    }
    print(kind, play, sound);
    add(all_play, play), add(all_sound, sound);
  }
  print("all", all_play, all_sound);
  return all_play.wrong_sure + all_sound.wrong_sure + all_sound.found > 0 ? 2 : 0;
}

}  // namespace
}  // namespace backlash::geared_arm

int main(int argc, char** argv) {
  namespace po = boost::program_options;
  backlash::geared_arm::Options o;
  po::options_description options("arm_traverse_study: plays of drawn arms by one encoder per joint");
  options.add_options()("help", "this text")("seed", po::value(&o.seed), "of all that is drawn")(
      "arms", po::value(&o.arms), "how many of each kind")("only", po::value(&o.only), "this one of them")(
      "duration", po::value(&o.duration), "of each record [s]")(
      "rig", po::value(&o.rig), "within the package")("kind", po::value(&o.kind),
                                                      "what is undeclared, or all")(
      "json", po::value(&o.out), "file that each answer is appended to, a line each");
  po::variables_map given;
  po::store(po::parse_command_line(argc, argv, options), given);
  po::notify(given);
  if (given.count("help") != 0u) {
    std::cout << options;
    return 0;
  }
  return backlash::geared_arm::run(o);
}
