#include "backlash_diagnosis/workflow/fitted_rig.h"

#include <cmath>
#include <cstdio>
#include <map>

#include "backlash_diagnosis/base/yaml_edit.h"
#include "backlash_diagnosis/identification/gap_terms.h"
#include "backlash_diagnosis/identification/rig_parameters.h"

namespace backlash {
namespace {

std::string digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

class RigText {
 public:
  explicit RigText(const RigFile& file) : text_(file.text), name_(file.source) {}

  const std::string& text() const { return text_; }

  void set(const std::string& key, double value, const std::string& comment) {
    text_ = with_yaml_value(text_, name_, key, digits(value), comment);
  }

  /// A number for both directions, or a map, as the file has it; a map where they differ.
  void set_directional(const std::string& part, const std::string& key, double mean, double asymmetry,
                       const std::string& comment) {
    const std::string full = "gear_train." + part + "." + key;
    const YamlReader body = YamlReader::from_text(text_, name_).map("gear_train").map(part);
    if (body.has(key) && !body.is_text(key)) {
      set(full + ".forward", mean + asymmetry, comment);
      set(full + ".backward", mean - asymmetry, comment);
    } else if (asymmetry != 0) {
      text_ = with_yaml_value(
          text_, name_, full,
          "{forward: " + digits(mean + asymmetry) + ", backward: " + digits(mean - asymmetry) + "}", comment);
    } else {
      set(full, mean, comment);
    }
  }

  void set_backlash(const Rig& rig, const std::string& comment) {
    const YamlReader mesh = YamlReader::from_text(text_, name_).map("gear_train").map("mesh");
    const double backlash = rig.mesh.backlash;
    if (mesh.has("backlash_angle"))
      set("gear_train.mesh.backlash_angle", backlash / rig.mesh.lever(), comment);
    else if (mesh.has("half_gap"))
      set("gear_train.mesh.half_gap", 0.5 * backlash, comment);
    else
      set("gear_train.mesh.backlash", backlash, comment);
  }

 private:
  std::string text_, name_;
};

/// "fitted, +- 0.3 %", of a value and the ones that belong to it.
std::string comment_of(const Identification& found, const std::string& name) {
  const Measured& m = found.parameters.at(name);
  char text[96];
  std::snprintf(text, sizeof text, "%s, fitted +- %.2g", found.units.at(name).c_str(), m.standard_error);
  return text;
}

struct DirectionalKey {
  const char *name, *part, *key;
};

void write_servo(RigText& text, const Identification& found, double ratio) {
  const Rig& rig = found.rig;
  const auto has = [&](const std::string& name) { return found.parameters.count(name) > 0; };
  const double square = ratio * ratio;
  if (has("motor_inertia"))
    text.set("gear_train.motor.inertia", rig.motor.inertia / square, comment_of(found, "motor_inertia"));
  if (has("load_inertia"))
    text.set("gear_train.link.inertia", rig.link.inertia, comment_of(found, "load_inertia"));
  for (const char* name : {"mesh_stiffness", "mesh_damping"})
    if (has(name))
      text.set(servo_parameter(name).key, servo_parameter(name).get(rig), comment_of(found, name));
  if (has("backlash_angle")) {
    text.set_backlash(rig, comment_of(found, "backlash_angle"));
    if (rig.mesh.start_in_gap != 0)
      text.set("gear_train.mesh.start_in_gap", rig.mesh.start_in_gap, "-, fitted");
  }
  if (has("motor_coulomb"))
    text.set_directional("motor", "coulomb_friction", rig.motor.coulomb_friction / ratio,
                         rig.motor.coulomb_asymmetry / ratio, comment_of(found, "motor_coulomb"));
  if (has("motor_viscous"))
    text.set_directional("motor", "viscous_damping", rig.motor.viscous_damping / square,
                         rig.motor.viscous_asymmetry / square, comment_of(found, "motor_viscous"));
  if (has("load_coulomb"))
    text.set_directional("link", "coulomb_friction", rig.link.coulomb_friction, rig.link.coulomb_asymmetry,
                         comment_of(found, "load_coulomb"));
  if (has("load_viscous"))
    text.set_directional("link", "viscous_damping", rig.link.viscous_damping, rig.link.viscous_asymmetry,
                         comment_of(found, "load_viscous"));
}

void write_one_inertia(RigText& text, const Identification& found, double ratio) {
  const Body& motor = found.rig.motor;
  text.set("gear_train.motor.inertia", motor.inertia / (ratio * ratio), comment_of(found, "inertia"));
  text.set_directional("motor", "viscous_damping", motor.viscous_damping / (ratio * ratio), 0,
                       comment_of(found, "viscous"));
  text.set_directional("motor", "coulomb_friction", motor.coulomb_friction / ratio,
                       motor.coulomb_asymmetry / ratio, comment_of(found, "coulomb"));
}

}  // namespace

std::string fitted_rig_text(const RigFile& declared, const Identification& found) {
  RigText text(declared);
  const double ratio = declared.rig.motor_axis_ratio();
  if (declared.rig.mesh.rigid)
    write_one_inertia(text, found, ratio);
  else
    write_servo(text, found, ratio);
  std::string fitted = text.text();
  if (found.gap_map && gap_varies(declared.rig))
    fitted = with_gap_terms(fitted, declared.source, *found.gap_map, found.rig.mesh.backlash / found.rig.mesh.lever());
  rig_file_from_text(fitted, declared.source);  // what is written can be read
  return fitted;
}

}  // namespace backlash
