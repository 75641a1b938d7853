// SPDX-License-Identifier: BSD-3-Clause
// Makes one test machine: two records of it and what it truly is. Deterministic for its arguments.
#include <algorithm>
#include <boost/program_options.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>

#include "effects.h"
#include "joint.h"

namespace machines {
namespace {

namespace po = boost::program_options;
using Json = nlohmann::ordered_json;

struct Options {
  std::uint64_t seed = 0;
  std::string machine, effects, friction, contact, out;
  double noise = 1, noise_share = 0, noise_corner = 0, skew = 0, duration = 30, order = 0, strength = 1,
         rate = 0;
  int encoder_bits = 0;
  bool dither = true;
  std::map<std::string, double> times;  // what is declared, by name as in truth.json
};

constexpr double kMotorInertia = 6.3,
                 kLoadInertia = 108;  // kg m^2, as config/two_inertia_servo.yaml has them

double times(const Options& options, const std::string& name) {
  const auto found = options.times.find(name);
  return found == options.times.end() ? 1 : found->second;
}

/// The declared values, those of config/two_inertia_servo.yaml times --times, each up to 40 % off.
Machine draw_machine(const Options& options) {
  Random random(options.seed, "machine");
  const auto near = [&](const char* name, double declared) {
    return times(options, name) * declared * random.uniform(0.6, 1.4);
  };
  Machine machine;
  machine.motor.inertia = near("motor_inertia", kMotorInertia);
  machine.load.inertia = near("load_inertia", kLoadInertia);
  machine.mesh.stiffness = near("mesh_stiffness", 460e3);
  machine.mesh.damping = near("mesh_damping", 483);
  machine.mesh.backlash = near("backlash_angle", 5.4e-4);
  machine.motor.friction.coulomb = near("motor_coulomb", 63);
  machine.motor.friction.viscous = near("motor_viscous", 13);
  machine.load.friction.coulomb = near("load_coulomb", 15);
  machine.load.friction.viscous = near("load_viscous", 9);
  machine.drive.gain =
      times(options, "loop_gain") *
      (times(options, "motor_inertia") * kMotorInertia + times(options, "load_inertia") * kLoadInertia) /
      (kMotorInertia + kLoadInertia);
  machine.sensors.torque_noise = options.noise * random.uniform(1, 3);
  machine.mesh.hertz = options.contact == "hertz";
  if (options.friction == "lugre") {
    for (Body* body : {&machine.motor, &machine.load}) {
      body->friction.bristle_length = 2e-5;
      // half of critical for the body on its bristles
      body->friction.bristle_damping =
          std::sqrt(body->inertia * body->friction.coulomb / body->friction.bristle_length);
    }
  }
  machine.sensors.load_skew = options.skew;
  machine.sensors.noise_corner = options.noise_corner;
  if (options.encoder_bits > 0) {  // as far apart as the declared ones
    machine.sensors.load_resolution = 2 * Random::kPi / std::ldexp(1, options.encoder_bits);
    machine.sensors.motor_resolution = machine.sensors.load_resolution / 8;
  }
  return machine;
}

struct Motions {
  std::string test_kind;
  Reference train, test;
  Circumstances circumstances;
};

/// Two motions that have a good part of their travel in common.
Motions draw_motions(const Options& options) {
  Random random(options.seed, "motions");
  Motions motions;
  motions.test_kind = random.chance(0.5) ? "sines" : "reversals";
  while (true) {
    motions.train = draw_reference("steps", options.dither, random);
    motions.test = draw_reference(motions.test_kind, options.dither, random);
    const Travel a = travel_of(motions.train, options.duration),
                 b = travel_of(motions.test, options.duration);
    const Travel common{std::max(a.from, b.from), std::min(a.to, b.to)};
    motions.circumstances = {options.duration, common, options.order, options.strength};
    if (common.to - common.from >= 0.5 * std::min(a.to - a.from, b.to - b.from)) return motions;
  }
}

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> ids;
  std::istringstream stream(list);
  for (std::string id; std::getline(stream, id, ',');) ids.push_back(id);
  return ids;
}

struct Added {
  Json undeclared = Json::object(), indistinguishable = Json::object();
  Json outside = Json::array();
};

Added add_effects(const Options& options, const Circumstances& circumstances, Machine& machine) {
  Added added;
  if (options.effects == "none") return added;
  for (const std::string& id : split(options.effects)) {
    const Effect& type = effect(id);
    Random random(options.seed, id);
    added.undeclared[id] = type.add(random, circumstances, machine);
    if (!type.in_dictionary) added.outside.push_back(id);
    if (!type.indistinguishable.empty()) added.indistinguishable[id] = type.indistinguishable;
  }
  return added;
}

Json rig(const Machine& machine) {
  const auto value = [](double v, const char* unit) { return Json{{"value", v}, {"unit", unit}}; };
  return {{"motor_inertia", value(machine.motor.inertia, "kg m^2")},
          {"load_inertia", value(machine.load.inertia, "kg m^2")},
          {"mesh_stiffness", value(machine.mesh.stiffness, "N m/rad")},
          {"mesh_damping", value(machine.mesh.damping, "N m s/rad")},
          {"backlash_angle", value(machine.mesh.backlash, "rad, total")},
          {"motor_coulomb", value(machine.motor.friction.coulomb, "N m")},
          {"motor_viscous", value(machine.motor.friction.viscous, "N m s/rad")},
          {"load_coulomb", value(machine.load.friction.coulomb, "N m")},
          {"load_viscous", value(machine.load.friction.viscous, "N m s/rad")},
          {"torque_noise_sd", value(machine.sensors.torque_noise, "N m")}};
}

/// Names that come with the machine's own laws: reporting them is no mistake, nor is leaving them out.
Json tolerated(const Options& options) {
  Json ids = Json::array();
  if (options.contact == "hertz") ids.push_back("mesh_hardening");
  if (options.friction == "lugre") ids.push_back("presliding");
  return ids;
}

double standard_deviation(const std::vector<Row>& rows) {
  double sum = 0, squares = 0;
  for (const Row& row : rows) sum += row.torque;
  const double mean = sum / static_cast<double>(rows.size());
  for (const Row& row : rows) squares += (row.torque - mean) * (row.torque - mean);
  return std::sqrt(squares / static_cast<double>(rows.size()));
}

void write_truth(const Options& options, const Json& truth) {
  std::ofstream file(options.out + "/truth.json");
  file << truth.dump(1) << '\n';
  if (!file.flush()) throw std::runtime_error("cannot write " + options.out + "/truth.json");
}

const JointEffect& joint_effect(const std::string& id) {
  for (const JointEffect& effect : joint_effects())
    if (effect.id == id) return effect;
  throw std::invalid_argument("no such effect of a joint: " + id);
}

void make_joint(const Options& options) {
  Random random(options.seed, "joint");
  Joint joint = draw_joint(random, options.rate);
  Json undeclared = Json::object(), outside = Json::array();
  if (options.effects != "none")
    for (const std::string& id : split(options.effects)) {
      Random own(options.seed, id);
      undeclared[id] = joint_effect(id).add(own, options.strength, options.duration, joint);
      if (joint_effect(id).outside) outside.push_back(id);
    }
  const bool moves = random.chance(0.5);
  Random train(options.seed, "train"), test(options.seed, "test");
  const std::vector<JointRow> first = run_joint(joint, moves, options.duration, train),
                              second = run_joint(joint, moves, options.duration * 5 / 8, test);
  std::filesystem::create_directories(options.out);
  write_csv(first, options.out + "/train.csv");
  write_csv(second, options.out + "/test.csv");
  write_truth(options, {{"undeclared_effects", undeclared},
                        {"joint",
                         {{"inertia", joint.inertia},
                          {"viscous", joint.friction.viscous},
                          {"coulomb", joint.friction.coulomb},
                          {"noise", joint.noise}}},
                        {"outside_dictionary", outside},
                        {"made_with",
                         {{"seed", options.seed},
                          {"duration", options.duration},
                          {"strength", options.strength},
                          {"rate", joint.rate},
                          {"jitter", joint.jitter},
                          {"motion", moves ? "moves" : "sines"}}}});
}

void make_servo(const Options& options) {
  Machine machine = draw_machine(options);
  const Motions motions = draw_motions(options);
  const Added added = add_effects(options, motions.circumstances, machine);
  std::vector<Row> train = run(machine, motions.train, options.duration, 1 / options.rate);
  std::vector<Row> test = run(machine, motions.test, options.duration, 1 / options.rate);
  if (options.noise_share > 0) machine.sensors.torque_noise = options.noise_share * standard_deviation(train);
  Random train_noise(options.seed, "noise of train"), test_noise(options.seed, "noise of test");
  measure(machine.sensors, 1 / options.rate, train_noise, train);
  measure(machine.sensors, 1 / options.rate, test_noise, test);

  std::filesystem::create_directories(options.out);
  write_csv(train, 1 / options.rate, options.out + "/train.csv");
  write_csv(test, 1 / options.rate, options.out + "/test.csv");
  const Json truth{{"undeclared_effects", added.undeclared},
                   {"rig", rig(machine)},
                   {"outside_dictionary", added.outside},
                   {"indistinguishable", added.indistinguishable},
                   {"tolerated", tolerated(options)},
                   {"made_with",
                    {{"seed", options.seed},
                     {"friction", options.friction},
                     {"contact", options.contact},
                     {"dither", options.dither},
                     {"duration", options.duration},
                     {"rate", options.rate},
                     {"strength", options.strength},
                     {"noise_corner", options.noise_corner},
                     {"encoder_skew", options.skew},
                     {"test_motion", motions.test_kind},
                     {"motor_resolution", machine.sensors.motor_resolution},
                     {"load_resolution", machine.sensors.load_resolution}}}};
  write_truth(options, truth);
}

/// NAME=FACTOR,NAME=FACTOR
std::map<std::string, double> read_times(const std::string& list) {
  const std::vector<std::string> known{"motor_inertia",  "load_inertia",  "mesh_stiffness", "mesh_damping",
                                       "backlash_angle", "motor_coulomb", "motor_viscous",  "load_coulomb",
                                       "load_viscous",   "loop_gain"};
  std::map<std::string, double> times;
  for (const std::string& item : split(list)) {
    const std::size_t middle = item.find('=');
    const std::string name = item.substr(0, middle);
    if (middle == std::string::npos || std::find(known.begin(), known.end(), name) == known.end())
      throw po::error("--times " + item + ": no NAME=FACTOR of a declared value");
    std::istringstream number(item.substr(middle + 1));
    if (!(number >> times[name] && number.eof() && times[name] > 0))
      throw po::error("--times " + item + ": no factor above 0");
  }
  return times;
}

void one_of(const std::string& name, const std::string& value, const std::vector<std::string>& known) {
  if (std::find(known.begin(), known.end(), value) == known.end()) {
    throw po::error("--" + name + " " + value + ": not known");
  }
}

/// False: help was asked for and given.
bool read_options(int argc, char** argv, Options& options) {
  po::options_description all("make_machine --seed N --out DIR [options]");
  auto add = all.add_options();
  add("help,h", "this text");
  add("seed", po::value(&options.seed)->required(), "everything random follows from it");
  add("out", po::value(&options.out)->required(), "folder for train.csv, test.csv and truth.json");
  add("machine", po::value(&options.machine)->default_value("servo"),
      "servo (two inertias, two encoders, speed loop) or joint (one encoder, position loop)");
  add("effects", po::value(&options.effects)->default_value("none"), "ids, with commas, or none");
  add("friction", po::value(&options.friction)->default_value("coulomb"), "coulomb or lugre");
  add("contact", po::value(&options.contact)->default_value("linear"), "linear or hertz");
  add("noise", po::value(&options.noise)->default_value(1), "times the torque noise of 1 to 3 N m");
  add("noise-share", po::value(&options.noise_share)->default_value(0),
      "torque noise as a share of the torque's standard deviation instead");
  add("noise-corner", po::value(&options.noise_corner)->default_value(0),
      "Hz, above which the torque noise falls (first order, of the same size); 0: white");
  add("skew", po::value(&options.skew)->default_value(0), "s, by which the load encoder is late");
  add("duration", po::value(&options.duration), "of a record [s]; 30, of a joint 80");
  add("strength", po::value(&options.strength)->default_value(1),
      "times the size of every effect: where does it stop to be seen?");
  add("rate", po::value(&options.rate),
      "Hz, of the record (the loop of a servo has 1000 at least); 1000, of a joint drawn");
  add("order", po::value(&options.order)->default_value(0),
      "of every effect that is a wave over a position, per turn of the load, any number; 0: drawn");
  add("encoder-bits", po::value(&options.encoder_bits)->default_value(0),
      "per turn of the load encoder, motor 3 more; 0: as declared");
  add("no-dither", "slow motions only");
  add("times", po::value<std::string>(),
      "NAME=FACTOR,...: a servo of another build, declared with so many times the usual value (names as in "
      "truth.json)");
  add("list", "all effects, those outside the dictionary marked with *");
  po::variables_map given;
  po::store(po::parse_command_line(argc, argv, all), given);
  if (given.count("help") != 0) {
    std::cout << all;
    return false;
  }
  if (given.count("list") != 0) {
    const bool joint = given["machine"].as<std::string>() == "joint";
    for (const Effect& effect : all_effects())
      if (!joint) std::cout << effect.id << (effect.in_dictionary ? "\n" : " *\n");
    for (const JointEffect& effect : joint_effects())
      if (joint) std::cout << effect.id << "\n";
    return false;
  }
  po::notify(given);
  one_of("machine", options.machine, {"servo", "joint"});
  const bool joint = options.machine == "joint";
  if (given.count("duration") == 0) options.duration = joint ? 80 : 30;
  if (given.count("rate") == 0) options.rate = joint ? 0 : 1000;
  if (!(options.strength >= 0)) throw po::error("--strength is not negative");
  if (given.count("rate") != 0 && !(options.rate >= 50 && options.rate <= 4000))
    throw po::error("--rate: 50 to 4000 Hz");
  one_of("friction", options.friction, {"coulomb", "lugre"});
  one_of("contact", options.contact, {"linear", "hertz"});
  if (!(options.duration >= 1 && options.duration <= 600)) throw po::error("--duration: 1 to 600 s");
  if (!(options.noise >= 0 && options.noise_share >= 0)) throw po::error("noise is not negative");
  if (!(options.noise_corner >= 0)) throw po::error("--noise-corner is not negative");
  if (!(options.skew >= 0 && options.skew < 0.1)) throw po::error("--skew: 0 to 0.1 s");
  if (!(options.order >= 0)) throw po::error("--order is not negative");
  options.dither = given.count("no-dither") == 0;
  if (given.count("times") != 0) options.times = read_times(given["times"].as<std::string>());
  return true;
}

}  // namespace
}  // namespace machines

int main(int argc, char** argv) {
  machines::Options options;
  try {
    if (!machines::read_options(argc, argv, options)) return 0;
    (options.machine == "joint" ? machines::make_joint : machines::make_servo)(options);
    return 0;
  } catch (const boost::program_options::error& error) {
    std::cerr << "make_machine: " << error.what() << '\n';
    return 64;
  } catch (const std::invalid_argument& error) {
    std::cerr << "make_machine: " << error.what() << '\n';
    return 64;
  } catch (const std::exception& error) {
    std::cerr << "make_machine: " << error.what() << '\n';
    return 73;
  }
}
