// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/rig.h"

namespace backlash::model {
namespace {

constexpr double kLongestSkew = 0.1;  // s, choice: what is later is no delay of an encoder

/// A number for both directions, or a map of `forward` and `backward`; as mean and half difference.
void read_directional(const YamlReader& parent, const std::string& key, double& mean, double& asymmetry) {
  if (!parent.has(key)) return;
  if (!parent.is_map(key)) {
    mean = parent.number(key, Range::not_negative());
    return;
  }
  const YamlReader yaml = parent.map(key);
  const double forward = yaml.number("forward", Range::not_negative());
  const double backward = yaml.number("backward", Range::not_negative());
  mean = 0.5 * (forward + backward);
  asymmetry = 0.5 * (forward - backward);
}

Body read_body(const YamlReader& yaml) {
  Body body;
  body.inertia = yaml.number("inertia", Range::positive());
  read_directional(yaml, "viscous_damping", body.viscous_damping, body.viscous_asymmetry);
  return body;
}

/// Motor and link: the ends of the train may also have dry friction.
Body read_end(const YamlReader& yaml) {
  Body body = read_body(yaml);
  read_directional(yaml, "coulomb_friction", body.coulomb_friction, body.coulomb_asymmetry);
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

/// What the torque sensor shows: absent, the spring (an ideal strain gauge).
bool read_sensor_output(const YamlReader& parent) {
  if (parent.is_text("input_coupling")) return false;
  const YamlReader yaml = parent.map("input_coupling");
  return yaml.has("output") && yaml.choice("output", {"spring", "spring_and_damper"}) == "spring_and_damper";
}

bool read_bearing(const YamlReader& parent) {
  if (parent.is_text("output_coupling")) return false;
  const YamlReader yaml = parent.map("output_coupling");
  return yaml.has("bearing") && yaml.choice("bearing", {"gear", "link"}) == "gear";
}

Mesh read_mesh(const YamlReader& yaml) {
  Mesh mesh;
  if (yaml.has("base_radius")) mesh.base_radius = yaml.number("base_radius", Range::positive());
  std::vector<std::string> given;
  for (const char* key : {"backlash", "half_gap", "backlash_angle"})
    if (yaml.has(key)) given.emplace_back(key);
  if (given.size() != 1)
    yaml.fail(given.empty() ? "backlash" : given.back(),
              "exactly one of backlash, half_gap, backlash_angle must be given");
  const std::string& key = given.front();
  if (mesh.angular() && key != "backlash_angle")
    yaml.fail(key, "a mesh without base_radius must state backlash_angle (rad)");
  const double factor = key == "half_gap" ? 2 : key == "backlash_angle" ? mesh.lever() : 1;
  mesh.backlash = factor * yaml.number(key, Range::between(0, mesh.most_backlash() / factor));
  mesh.start_in_gap = yaml.number_or("start_in_gap", 0, Range::between(-1, 1));
  const ContactSpec contact = read_contact_spec(yaml.map("contact"));
  mesh.contact = make_contact_law(contact.law, contact.values);
  if (const auto pairs = yaml.optional_map("tooth_pairs")) {
    if (yaml.has("stiffness_variation"))
      yaml.fail("tooth_pairs", "holds the stiffness of each pair: leave stiffness_variation out");
    if (mesh.contact->needs_impact_speed())
      yaml.fail("tooth_pairs",
                "the contact law " + contact.law + " needs the speed of one touch, pairs have several");
    mesh.pairs = read_tooth_pairs(*pairs, mesh.base_radius);
  }
  if (const auto variation = yaml.optional_map("stiffness_variation"))
    mesh.variation = read_stiffness_variation(*variation, mesh.base_radius);
  return mesh;
}

void read_gear_train(const YamlReader& yaml, Rig& rig) {
  rig.reduction_ratio = yaml.number("reduction_ratio", Range::positive());
  rig.motor_side = yaml.boolean_or("motor_side", false);
  rig.coupled = yaml.boolean_or("coupled", false);
  rig.linear = yaml.has("axis") && yaml.choice("axis", {"rotary", "linear"}) == "linear";
  const YamlReader motor = yaml.map("motor");
  rig.motor = read_end(motor);
  if (motor.has("torque_constant")) rig.torque_constant = motor.number("torque_constant", Range::positive());
  rig.input_coupling = read_coupling(yaml, "input_coupling");
  rig.sensor_with_damper = read_sensor_output(yaml);
  if (rig.input_coupling.rigid && !yaml.has("pinion"))
    rig.pinion = Body{};  // lumped with the motor
  else
    rig.pinion = read_body(yaml.map("pinion"));
  if (yaml.is_text("mesh"))
    rig.mesh.rigid = yaml.choice("mesh", {"rigid"}) == "rigid";
  else
    rig.mesh = read_mesh(yaml.map("mesh"));
  rig.output_coupling = read_coupling(yaml, "output_coupling");
  rig.bearing_at_gear = read_bearing(yaml);
  if (rig.bearing_at_gear && rig.mesh.rigid)
    yaml.fail("output_coupling", "a bearing at the gear needs a mesh that gives way");
  if (yaml.is_text("link")) {
    yaml.choice("link", {"locked"});
    rig.link_locked = true;
    if (rig.bearing_at_gear) yaml.fail("link", "a locked link has no bearing at the gear");
    if (rig.mesh.rigid && rig.output_coupling.rigid)
      yaml.fail("link", "a locked link on a rigid mesh moves nothing");
  } else if (yaml.has("link") || !rig.mesh.rigid || !rig.output_coupling.rigid) {
    rig.link = read_end(yaml.map("link"));
  }
  if (yaml.has("gear"))
    rig.gear = read_body(yaml.map("gear"));
  else if (!rig.output_coupling.rigid)
    yaml.fail("gear", "is required with a flexible output coupling");
}

class NoContact : public ContactLaw {
 public:
  double force(double, double, double) const override { return 0; }
  double elastic_energy(double) const override { return 0; }
  double static_penetration(double) const override { return std::numeric_limits<double>::infinity(); }
};

}  // namespace

const ContactSpec& Mesh::contact_spec() const {
  static const ContactSpec none;
  return contact ? contact->made_of : none;
}

Rig without_load(Rig rig) {
  rig.mesh.contact = std::make_shared<NoContact>();
  return rig;
}

Rig read_rig(const YamlReader& yaml) {
  Rig rig;
  rig.name = yaml.text("name");
  rig.joint = yaml.text("joint");
  read_gear_train(yaml.map("gear_train"), rig);
  if (yaml.has("terms"))
    for (const YamlReader& term : yaml.maps("terms")) rig.terms.push_back(read_term(term));
  if (const auto sensors = yaml.optional_map("sensors"))
    rig.encoder_skew = sensors->number_or("encoder_skew", 0, Range::between(-kLongestSkew, kLongestSkew));
  return rig;
}

bool has_two_inertias(const Rig& rig) {
  return !rig.mesh.rigid && rig.input_coupling.rigid && rig.output_coupling.rigid && !rig.link_locked;
}

Rig load_side(const Rig& rig) {
  Rig out = rig;
  const double ratio = rig.motor_axis_ratio(), square = ratio * ratio;
  for (Body* body : {&out.motor, &out.pinion}) {
    body->inertia *= square;
    body->viscous_damping *= square;
    body->viscous_asymmetry *= square;
    body->coulomb_friction *= ratio;
    body->coulomb_asymmetry *= ratio;
  }
  out.input_coupling.stiffness *= square;
  out.input_coupling.damping *= square;
  out.input_coupling.inertia *= square;
  out.torque_constant *= ratio;
  out.motor_side = false;
  return out;
}

}  // namespace backlash::model
