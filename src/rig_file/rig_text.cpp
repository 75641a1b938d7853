// SPDX-License-Identifier: BSD-3-Clause
#include "rig_text.h"

#include <cmath>
#include <cstdio>
#include <set>
#include <sstream>

#include "backlash_diagnosis/base/yaml_tree.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/rig_file/yaml_edit.h"

namespace backlash {
namespace {

std::string digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

}  // namespace

void RigText::set(const std::string& key, double value, const std::string& comment) {
  text_ = with_yaml_value(text_, name_, key, digits(value), comment);
}

void RigText::set_directional(const std::string& part, const std::string& key, double mean, double asymmetry,
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

void RigText::set_backlash(const Rig& rig, const std::string& comment) {
  const YamlReader mesh = YamlReader::from_text(text_, name_).map("gear_train").map("mesh");
  const double backlash = rig.mesh.backlash;
  if (mesh.has("backlash_angle"))
    set("gear_train.mesh.backlash_angle", backlash / rig.mesh.lever(), comment);
  else if (mesh.has("half_gap"))
    set("gear_train.mesh.half_gap", 0.5 * backlash, comment);
  else
    set("gear_train.mesh.backlash", backlash, comment);
}

void RigText::set_contact_law(const ContactSpec& contact) {
  const YamlTree tree = parse_yaml(text_, name_);
  const YamlNode& declared =
      *tree.root->entries.at("gear_train").value->entries.at("mesh").value->entries.at("contact").value;
  std::set<int> dropped;  // lines
  for (const auto& [key, entry] : declared.entries)
    if (key != "law" && !contact.values.has(key)) dropped.insert(entry.line);
  std::istringstream in(text_);
  std::string kept, line;
  for (int number = 1; std::getline(in, line); ++number)
    if (dropped.count(number) == 0) kept += line + '\n';
  text_ = with_yaml_value(kept, name_, "gear_train.mesh.contact.law", contact.law);
  for (const ContactLawType& type : contact_laws()) {
    if (type.name != contact.law) continue;
    for (const ParameterSpec& spec : type.parameters)
      set("gear_train.mesh.contact." + spec.name, contact.values.at(spec.name), spec.unit);
  }
}

std::string FittedMachine::comment(const std::string& name, double divisor) const {
  const double error = parameters.at(name).standard_error;
  if (!std::isfinite(error)) return units.at(name) + ", fitted";
  char text[96];
  std::snprintf(text, sizeof text, "%s, fitted +- %.2g", units.at(name).c_str(), error / divisor);
  return text;
}

void write_servo(RigText& text, const FittedMachine& found, double ratio) {
  const Rig& rig = found.rig;
  const auto has = [&](const std::string& name) { return found.parameters.count(name) > 0; };
  const double square = ratio * ratio;
  if (has("motor_inertia"))
    text.set("gear_train.motor.inertia", rig.motor.inertia / square, found.comment("motor_inertia", square));
  if (has("load_inertia"))
    text.set("gear_train.link.inertia", rig.link.inertia, found.comment("load_inertia"));
  for (const char* name : {"mesh_stiffness", "mesh_damping", "mesh_alpha"})
    if (has(name)) text.set(servo_parameter(name).key, servo_parameter(name).get(rig), found.comment(name));
  if (has("backlash_angle")) {
    text.set_backlash(rig, found.comment("backlash_angle"));
    if (rig.mesh.start_in_gap != 0)
      text.set("gear_train.mesh.start_in_gap", rig.mesh.start_in_gap, "-, fitted");
  }
  if (has("motor_coulomb"))
    text.set_directional("motor", "coulomb_friction", rig.motor.coulomb_friction / ratio,
                         rig.motor.coulomb_asymmetry / ratio, found.comment("motor_coulomb", ratio));
  if (has("motor_viscous"))
    text.set_directional("motor", "viscous_damping", rig.motor.viscous_damping / square,
                         rig.motor.viscous_asymmetry / square, found.comment("motor_viscous", square));
  if (has("load_coulomb"))
    text.set_directional("link", "coulomb_friction", rig.link.coulomb_friction, rig.link.coulomb_asymmetry,
                         found.comment("load_coulomb"));
  if (has("load_viscous"))
    text.set_directional("link", "viscous_damping", rig.link.viscous_damping, rig.link.viscous_asymmetry,
                         found.comment("load_viscous"));
}

}  // namespace backlash
