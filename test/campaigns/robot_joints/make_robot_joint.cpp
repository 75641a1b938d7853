// SPDX-License-Identifier: BSD-3-Clause
// Makes one joint: OUT/m0.csv and m1.csv, rig.yaml, truth.json.
#include <fmt/format.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "robot_joint.h"

namespace robot_joints {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Values& v) {
  return {{"Jl", v.load_inertia},  {"Jm", v.motor_inertia}, {"K", v.stiffness},     {"b", v.backlash},
          {"bm", v.motor_viscous}, {"Fm", v.motor_coulomb}, {"bl", v.load_viscous}, {"Fl", v.load_coulomb},
          {"c", v.damping},        {"G", v.gravity},        {"gp", v.gravity_phase}};
}

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

std::string csv_of(const Run& run) {
  std::string text = "time,motor_torque,motor_position,load_position\n";
  for (const Row& r : run.rows)
    text += fmt::format("{:.6f},{:.6g},{:.10f},{:.10f}\n", r.time, r.torque, r.motor, r.load);
  return text;
}

}  // namespace

std::string truth(const Machine& m, const std::vector<std::pair<std::string, Run>>& runs) {
  static const char* const teeth[] = {"linear", "hertz", "cubic", "hysteresis"};
  Json json = {{"backlash_angle", m.real.backlash},
               {"true", json_of(m.real)},
               {"declared", json_of(m.declared)},
               {"teeth", teeth[int(m.teeth)]},
               {"power", m.power},
               {"friction", m.bristles ? "lugre" : "coulomb"},
               {"masses",
                {{"pinion", m.masses.pinion},
                 {"input_shaft", m.masses.input_shaft},
                 {"wheel", m.masses.wheel},
                 {"output_shaft", m.masses.output_shaft},
                 {"flange", m.masses.flange}}},
               {"skew", m.skew},
               {"eccentricity", m.eccentricity}};
  if (const Effect& e = m.effect; !e.id.empty()) {
    json["undeclared_effects"] = Json::object();
    if (e.id != "none")
      json["undeclared_effects"][e.id] = {
          {"size", e.size}, {"order", e.order}, {"speed", e.speed}, {"phase", e.phase}};
    json["outside_dictionary"] = Json::array();
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Run& run = runs[i].second;
    json["motions"][fmt::format("m{}", i)] = {{"kind", runs[i].first},
                                              {"crossings", run.crossings},
                                              {"press_pos", run.forward},
                                              {"press_neg", run.backward},
                                              {"maxT", run.most_torque}};
  }
  return json.dump(1);
}

std::string rig_file(const Machine& m, const std::string& name) {
  const Values& d = m.declared;
  std::string terms;
  if (d.gravity > 0)
    terms = fmt::format("terms:\n  - {{id: gravity, amplitude: {:.4g}, phase: {:.5g}}}\n", d.gravity,
                        d.gravity_phase);
  return fmt::format(R"(schema_version: 1
name: {}
joint: joint
gear_train:
  reduction_ratio: {}
  motor:
    inertia: {:.3g}
    viscous_damping: {:.3g}
    coulomb_friction: {:.3g}
  input_coupling: rigid
  mesh:
    backlash_angle: {:.3g}
    contact:
      law: linear
      stiffness: {:.3g}
      damping: {:.3g}
  output_coupling: rigid
  link:
    inertia: {:.3g}
    viscous_damping: {:.3g}
    coulomb_friction: {:.3g}
{}excitation:
  type: sine
  amplitude: 40
  frequency: 1
sensors:
  sampling_rate: {}
  seed: 1
  motor_torque: {{noise: {:.3g}}}
  motor_position: {{resolution: {:.3g}}}
  load_position: {{resolution: {:.3g}}}
solver:
  method: dormand_prince
  relative_tolerance: 1.0e-6
  position_tolerance: 1.0e-9
  velocity_tolerance: 1.0e-6
diagnosis:
  stiffness_uncertainty: 0.2
  limits:
    backlash_angle:
      watch: {:.3g}
      service: {:.3g}
      stop: {:.3g}
)",
                     name, m.ratio, d.motor_inertia, d.motor_viscous, d.motor_coulomb, d.backlash,
                     d.stiffness, d.damping, d.load_inertia, d.load_viscous, d.load_coulomb, terms, m.rate,
                     m.noise, m.motor_resolution, m.load_resolution, 1.5 * d.backlash, 2.5 * d.backlash,
                     4 * d.backlash);
}

namespace {

void make(std::uint64_t seed, const std::string& effect, bool own_teeth, bool masses, double duration,
          double stamp_jitter, const std::filesystem::path& out) {
  Random machine_stream(seed, "machine");
  Machine machine = draw_machine(machine_stream);
  Random masses_stream(seed, "masses");
  if (masses) machine.masses = draw_masses(masses_stream);
  if (!effect.empty()) {
    const auto& ids = effect_ids();
    if (std::find(ids.begin(), ids.end(), effect) == ids.end())
      throw std::invalid_argument(fmt::format("effect {} is none of {}", effect, fmt::join(ids, " ")));
    Random effect_stream(seed, "effect");
    machine = with_effect(machine, effect, own_teeth, effect_stream);
  }
  std::filesystem::create_directories(out);
  std::vector<std::pair<std::string, Run>> runs;
  for (int i = 0; i < 2; ++i) {
    Random stream(seed, fmt::format("motion {}", i));
    static const char* const kinds[] = {"pick", "sine", "multi", "via"};
    const std::string kind = kinds[stream.whole(0, 3)];
    runs.emplace_back(kind, run(machine, kind, duration, stream));
    Random stamps(seed, fmt::format("stamps {}", i));
    jitter_stamps(runs.back().second, stamp_jitter, machine.rate, stamps);
    write(out / fmt::format("m{}.csv", i), csv_of(runs.back().second));
  }
  write(out / "rig.yaml", rig_file(machine, fmt::format("robot_joint_{}", seed)));
  write(out / "truth.json", truth(machine, runs));
}

}  // namespace
}  // namespace robot_joints

int main(int argc, char** argv) {
  namespace po = boost::program_options;
  po::options_description options("make_robot_joint: two records of a robot's joint with truth");
  std::uint64_t seed = 1;
  double duration = 25, stamp_jitter = 0;
  std::string out, effect;
  bool own_teeth = false, masses = false;
  options.add_options()("help,h", "this text")("seed", po::value(&seed)->required(),
                                               "of the machine and its motions")(
      "effect", po::value(&effect),
      "one that the rig file does not know, on a joint with mild errors of its sensors")(
      "own-teeth", po::bool_switch(&own_teeth),
      "with --effect: teeth and friction as drawn, else the plainest")(
      "masses", po::bool_switch(&masses),
      "a pinion behind a shaft of its own, other shafts, the output's encoder at the flange")(
      "duration", po::value(&duration)->default_value(25), "of a record [s]")(
      "stamp-jitter", po::value(&stamp_jitter)->default_value(0),
      "of stamps alone: standard deviation, share of an interval")(
      "out", po::value(&out)->required(), "folder for m0.csv, m1.csv, rig.yaml, truth.json");
  try {
    po::variables_map given;
    po::store(po::parse_command_line(argc, argv, options), given);
    if (given.count("help") != 0) {
      std::cout << options;
      return 0;
    }
    po::notify(given);
    robot_joints::make(seed, effect, own_teeth, masses, duration, stamp_jitter, out);
    return 0;
  } catch (const po::error& error) {
    std::cerr << "make_robot_joint: " << error.what() << '\n';
    return 64;
  } catch (const std::exception& error) {
    std::cerr << "make_robot_joint: " << error.what() << '\n';
    return 73;
  }
}
