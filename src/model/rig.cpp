#include "backlash_diagnosis/model/rig.h"

namespace backlash {
namespace {

Body read_body(const YamlReader& yaml) {
  Body body;
  body.inertia = yaml.number("inertia", Range::positive());
  body.viscous_damping = yaml.number_or("viscous_damping", 0, Range::not_negative());
  return body;
}

Coupling read_coupling(const YamlReader& parent, const std::string& key) {
  Coupling coupling;
  if (parent.is_text(key)) {
    parent.choice(key, {"rigid"});
    return coupling;
  }
  const YamlReader yaml = parent.map(key);
  coupling.rigid = false;
  coupling.stiffness = yaml.number("stiffness", Range::positive());
  coupling.damping = yaml.number("damping", Range::not_negative());
  coupling.inertia = yaml.number_or("inertia", 0, Range::not_negative());
  return coupling;
}

Mesh read_mesh(const YamlReader& yaml) {
  Mesh mesh;
  if (yaml.has("base_radius")) mesh.base_radius = yaml.number("base_radius", Range::positive());
  const char* const keys[] = {"backlash", "half_gap", "backlash_angle"};
  int given = 0;
  for (const char* key : keys) given += yaml.has(key);
  if (given != 1) yaml.fail("backlash", "exactly one of backlash, half_gap, backlash_angle must be given");
  if (yaml.has("half_gap")) mesh.backlash = 2 * yaml.number("half_gap", Range::not_negative());
  if (yaml.has("backlash")) mesh.backlash = yaml.number("backlash", Range::not_negative());
  if (yaml.has("backlash_angle"))
    mesh.backlash = mesh.lever() * yaml.number("backlash_angle", Range::not_negative());
  else if (mesh.angular())
    yaml.fail("backlash", "a mesh without base_radius must state backlash_angle (rad)");
  mesh.contact = read_contact_law(yaml.map("contact"));
  return mesh;
}

void read_gear_train(const YamlReader& yaml, Rig& rig) {
  rig.reduction_ratio = yaml.number("reduction_ratio", Range::positive());
  rig.motor_side = yaml.boolean_or("motor_side", false);
  rig.motor = read_body(yaml.map("motor"));
  rig.input_coupling = read_coupling(yaml, "input_coupling");
  if (rig.input_coupling.rigid && !yaml.has("pinion"))
    rig.pinion = Body{};  // lumped with the motor
  else
    rig.pinion = read_body(yaml.map("pinion"));
  rig.mesh = read_mesh(yaml.map("mesh"));
  rig.output_coupling = read_coupling(yaml, "output_coupling");
  if (yaml.is_text("link")) {
    yaml.choice("link", {"locked"});
    rig.link_locked = true;
  } else {
    rig.link = read_body(yaml.map("link"));
  }
  if (yaml.has("gear"))
    rig.gear = read_body(yaml.map("gear"));
  else if (!rig.output_coupling.rigid)
    yaml.fail("gear", "is required with a flexible output coupling");
}

}  // namespace

Rig read_rig(const YamlReader& yaml) {
  Rig rig;
  rig.name = yaml.text("name");
  rig.joint = yaml.text("joint");
  read_gear_train(yaml.map("gear_train"), rig);
  if (yaml.has("terms"))
    for (const YamlReader& term : yaml.maps("terms")) rig.terms.push_back(read_term(term));
  return rig;
}

}  // namespace backlash
