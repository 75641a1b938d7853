// SPDX-License-Identifier: BSD-3-Clause
// Makes one rig: OUT/square.csv, sine.csv, random.csv, rig.yaml, truth.json.
#include <fmt/format.h>

#include <boost/program_options.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "torque_rig.h"

namespace torque_rigs {
namespace {

using Json = nlohmann::ordered_json;

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

std::string csv_of(const std::vector<Row>& rows) {
  std::string text = "time,motor_torque,motor_position,sensor_torque\n";
  for (const Row& r : rows)
    text += fmt::format("{:.6f},{:.6g},{:.9g},{:.6g}\n", r.time, r.torque, r.position, r.sensor);
  return text;
}

std::string rig_file(const Machine& m, const std::string& name) {
  const Values& d = m.declared;
  return fmt::format(R"(schema_version: 1
name: {}
joint: joint
gear_train:
  reduction_ratio: 1.0
  motor: {{inertia: {:.4g}, viscous_damping: {:.4g}}}
  input_coupling: {{stiffness: {:.4g}, damping: {:.4g}, inertia: 0.0}}
  pinion: {{inertia: {:.4g}}}
  mesh:
    base_radius: {:.5g}
    half_gap: 0.0
    contact: {{law: hunt_crossley, stiffness: {:.4g}, exponent: 1.5, alpha: {:.3g}}}
  gear: {{inertia: {:.4g}}}
  output_coupling: {{stiffness: {:.4g}, damping: {:.4g}}}
  link: locked
excitation: {{type: square, amplitude: {:.3g}, frequency: 10}}
sensors: {{sampling_rate: {}, seed: 1}}
solver:
  method: dormand_prince
  relative_tolerance: 1.0e-6
  position_tolerance: 1.0e-10
  velocity_tolerance: 1.0e-7
diagnosis:
  stiffness_uncertainty: 0.01
  lost_motion: {{torque: {:.3g}, elastic_deflection: subtracted}}
)",
                     name, d.motor_inertia, d.motor_damping, d.sensor_stiffness, d.sensor_damping,
                     d.pinion_inertia, m.radius, d.contact, d.loss, d.gear_inertia, d.output_stiffness,
                     d.output_damping, m.level, m.rate, 0.9 * m.level);
}

std::string truth(const Machine& m, const std::vector<std::pair<std::string, std::string>>& runs) {
  Json json = {{"backlash", m.backlash},
               {"backlash_angle", m.backlash / m.radius},
               {"rate", m.rate},
               {"hysteresis", m.hysteresis},
               {"cogging", m.cogging},
               {"sensor_lag", m.sensor_lag},
               {"bending", m.bending},
               {"drive_lag", m.drive_lag},
               {"drive_noise", m.drive_noise},
               {"sensor_noise", m.sensor_noise},
               {"resolution", m.resolution},
               {"friction", m.friction},
               {"jitter", m.jitter},
               {"lost", m.lost}};
  for (const auto& [name, kind] : runs) json["motions"][name] = {{"kind", kind}};
  return json.dump(1);
}

void make(std::uint64_t seed, bool effects, double lost, double duration, const std::filesystem::path& out) {
  Random machine_stream(seed, "machine");
  Machine machine = draw_machine(machine_stream, effects);
  if (lost >= 0) machine.lost = lost;
  std::filesystem::create_directories(out);
  std::vector<std::pair<std::string, std::string>> runs;
  for (const std::string name : {"square", "sine", "random"}) {
    Random stream(seed, name);
    const std::string kind = name != "random" ? name : stream.chance(0.5) ? "binary" : "multi";
    runs.emplace_back(name, kind);
    write(out / (name + ".csv"), csv_of(run(machine, kind, duration, stream)));
  }
  write(out / "rig.yaml", rig_file(machine, fmt::format("torque_rig_{}", seed)));
  write(out / "truth.json", truth(machine, runs));
}

}  // namespace
}  // namespace torque_rigs

int main(int argc, char** argv) {
  namespace po = boost::program_options;
  po::options_description options("make_torque_rig: three records of a rig with a torque sensor, with truth");
  std::uint64_t seed = 1;
  double duration = 2, lost = -1;
  std::string out;
  options.add_options()("help,h", "this text")("seed", po::value(&seed)->required(),
                                               "of the rig and its torques")(
      "plain", "nothing that the rig file has not, but its values are off")(
      "lost", po::value(&lost), "share of the samples that are lost (default: as drawn)")(
      "duration", po::value(&duration)->default_value(2), "of a record [s]")(
      "out", po::value(&out)->required(), "folder for the records, rig.yaml, truth.json");
  try {
    po::variables_map given;
    po::store(po::parse_command_line(argc, argv, options), given);
    if (given.count("help") != 0) {
      std::cout << options;
      return 0;
    }
    po::notify(given);
    torque_rigs::make(seed, given.count("plain") == 0, lost, duration, out);
    return 0;
  } catch (const po::error& error) {
    std::cerr << "make_torque_rig: " << error.what() << '\n';
    return 64;
  } catch (const std::exception& error) {
    std::cerr << "make_torque_rig: " << error.what() << '\n';
    return 73;
  }
}
