#include "backlash_diagnosis/workflow/rig_file.h"

#include <cmath>
#include <iterator>
#include <memory>

#include "backlash_diagnosis/base/file.h"
#include "default_rig.h"

namespace backlash {
namespace {

std::string digest_of(const std::string& text) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const unsigned char c : text) hash = (hash ^ c) * 1099511628211ULL;
  static const char* const hex = "0123456789abcdef";
  std::string digest;
  for (int shift = 60; shift >= 0; shift -= 4) digest += hex[(hash >> shift) & 15];
  return digest;
}

}  // namespace

RigFile rig_file_from_text(const std::string& text, const std::string& source) {
  const YamlReader yaml = YamlReader::from_text(text, source);
  RigFile file;
  file.source = source;
  file.text = text;
  file.digest = digest_of(text);
  yaml.integer("schema_version", 1, 1);
  file.rig = read_rig(yaml);
  file.simulation = read_simulation_settings(yaml);
  file.diagnosis = read_diagnosis_settings(yaml.map("diagnosis"));
  yaml.finish();
  if (file.diagnosis.limits && !file.diagnosis.limits->angular && file.rig.mesh.angular())
    yaml.map("diagnosis").fail("limits", "a rig without base_radius needs limits of backlash_angle");
  if (file.simulation.sensors.of(Channel::motor_current).declared && std::isnan(file.rig.torque_constant))
    yaml.map("sensors").fail("motor_current", "needs gear_train.motor.torque_constant (N m/A)");
  const auto train = std::make_shared<GearTrain>(file.rig);  // refuses what cannot move
  if (file.diagnosis.lost_motion) {
    LostMotionSettings& lost_motion = *file.diagnosis.lost_motion;
    lost_motion.elastic_deflection = [train](double torque) { return train->elastic_deflection(torque); };
    if (!file.rig.mesh.angular()) lost_motion.base_radius = 1 / file.rig.backlash_angle(1);
  }
  return file;
}

RigFile load_rig_file(const std::string& path) {
  std::ifstream in = open_input(path);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  return rig_file_from_text(text, path);
}

RigFile default_rig_file() {
  return rig_file_from_text(kDefaultRig, "built-in sarkar_1997");
}

}  // namespace backlash
