// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/arm_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/channels.h"
#include "joint_effects.h"

namespace backlash::arm {

const std::array<DriveTermSpec, kDriveTerms> kDriveTermSpecs = {{{"rotor_inertia", "kg m^2", true},
                                                                 {"coulomb", "N m", true},
                                                                 {"viscous", "N m s/rad", false},
                                                                 {"quadratic", "N m s^2/rad^2", false},
                                                                 {"cubic", "N m s^3/rad^3", false},
                                                                 {"offset", "N m", false},
                                                                 {"load", "-", true}}};

const std::array<const char*, 10> kStandardNames = {"mass",       "moment_x",   "moment_y",   "moment_z",
                                                    "inertia_xx", "inertia_xy", "inertia_xz", "inertia_yy",
                                                    "inertia_yz", "inertia_zz"};
const std::array<const char*, 10> kStandardUnits = {"kg",     "kg m",   "kg m",   "kg m",   "kg m^2",
                                                    "kg m^2", "kg m^2", "kg m^2", "kg m^2", "kg m^2"};

namespace {

constexpr int kSchema = 1;
const char *const kNotShown = "not_shown", *const kInSums = "in_sums";  // keys of a fitted link
const Range kCutoff = {0.1, 1000, false};                               // Hz; choice
constexpr double kLongestDelay = 0.2;                                   // s; choice: more is another record

Eigen::Vector3d vector(const YamlReader& yaml, const std::string& key, std::size_t size = 3) {
  const std::vector<double> v = yaml.numbers(key, Range::any());
  if (v.size() != size) yaml.fail(key, fmt::format("{} numbers, expected {}", v.size(), size));
  return {v[0], v[1], v[2]};
}

Body read_body(const YamlReader& yaml) {
  Body b;
  b.mass = yaml.number("mass", Range::positive());
  b.centre = vector(yaml, "centre");
  const std::vector<double> i = yaml.numbers("inertia", Range::any());
  if (i.size() != 6) yaml.fail("inertia", "expected 6 numbers: xx, xy, xz, yy, yz, zz");
  b.inertia << i[0], i[1], i[2], i[1], i[3], i[4], i[2], i[4], i[5];
  if (!is_consistent(parameters_of(b))) yaml.fail("inertia", "no body has such an inertia");
  return b;
}

DriveTerm term_of(const std::string& name) {
  for (std::size_t i = 0; i < kDriveTerms; ++i)
    if (name == kDriveTermSpecs[i].name) return DriveTerm(i);
  throw InvalidParameter("term", name, "is none of those of a drive");
}

std::vector<std::string> term_names() {
  std::vector<std::string> names;
  for (const DriveTermSpec& spec : kDriveTermSpecs) names.emplace_back(spec.name);
  return names;
}

/// Columns of a file; the messages of an arm's topics have the robot's own names.
record::ChannelMap read_joint_channels(const YamlReader& yaml, const std::string& joint,
                                       const record::ChannelMap& time, record::Channel channel) {
  const auto channels = yaml.optional_map("channels");
  if (!channels) return {};
  record::ChannelMap map = record::read_channels(yaml, joint, false, time);
  const auto has = [&](record::Channel wanted) {
    return std::any_of(map.columns.begin(), map.columns.end(),
                       [&](const record::ColumnSource& c) { return c.channel == wanted; });
  };
  for (const record::Channel wanted : {record::Channel::motor_position, channel})
    if (!has(wanted))
      yaml.fail("channels", "must say the column of " + record::channel_name(wanted) + " for " + joint);
  if (map.declared) yaml.fail("channels", "of an arm's joint are columns: `name` is none");
  return map;
}

JointDrive read_joint(const YamlReader& yaml, const record::ChannelMap& time, record::Channel channel) {
  JointDrive joint;
  joint.name = yaml.text("name");
  joint.constant = yaml.number_or("torque_constant", 1, Range::positive());
  if (const auto error = yaml.uncertainty("torque_constant"))
    joint.constant_error = error->relative ? error->size : error->size / joint.constant;
  for (std::size_t i = 0; i < kDriveTerms; ++i) {
    const DriveTermSpec& spec = kDriveTermSpecs[i];
    joint.terms[i] = yaml.number_or(spec.name, 0, spec.dissipates ? Range::not_negative() : Range::any());
    if (const auto error = yaml.uncertainty(spec.name); error && DriveTerm(i) == DriveTerm::load)
      joint.load_error = error->relative ? error->size * joint.terms[i] : error->size;
  }
  joint.delay = yaml.number_or("delay", 0, Range::between(-kLongestDelay, kLongestDelay));
  yaml.uncertainty("delay");
  if (yaml.has("friction_speed")) joint.friction_speed = yaml.number("friction_speed", Range::positive());
  if (yaml.has("friction_distance"))
    joint.friction_distance = yaml.number("friction_distance", Range::positive());
  if (yaml.has("effects"))
    for (const YamlReader& effect : yaml.maps("effects")) joint.effects.push_back(read_joint_effect(effect));
  // of the room geared_arm
  for (const char* key :
       {"gear", "limits", "link_coulomb", "link_viscous", "held", "excitation", "motion_limits"})
    yaml.ignore(key);
  joint.channels = read_joint_channels(yaml, joint.name, time, channel);
  joint.training_error = yaml.number_or("training_error", 0, Range::not_negative());
  return joint;
}

ArmIdentification read_identification(const YamlReader& yaml) {
  ArmIdentification s;
  s.kinematics_cutoff = yaml.number("kinematics_cutoff", kCutoff);
  s.torque_cutoff = yaml.number("torque_cutoff", kCutoff);
  s.slowest = yaml.number("slowest", Range::positive());
  s.friction_speed = yaml.number("friction_speed", Range::positive());
  return s;
}

std::size_t link_index(const Chain& chain, const YamlReader& yaml, const std::string& key) {
  const std::string name = yaml.text(key);
  std::vector<std::string> links;
  for (std::size_t i = 0; i < chain.size(); ++i) {
    if (chain.joints[i].link == name) return i;
    links.push_back(chain.joints[i].link);
  }
  yaml.fail(key, "no such link; there are: " + joined(links));
}

/// The standard parameters of a link that a list names.
void read_shown(const YamlReader& link, const char* key, Shown as, std::size_t index, ArmRig& rig) {
  if (!link.has(key)) return;
  for (const std::string& name : link.texts(key)) {
    const auto found = std::find(kStandardNames.begin(), kStandardNames.end(), name);
    if (found == kStandardNames.end())
      link.fail(key, "'" + printable(name) + "': known are " + joined(kStandardNames));
    rig.shown[10 * index + std::size_t(found - kStandardNames.begin())] = as;
  }
}

void read_links(const YamlReader& yaml, ArmRig& rig) {
  std::vector<char> seen(rig.chain.size(), 0);
  rig.shown.assign(10 * rig.chain.size(), Shown::leads);
  for (const YamlReader& link : yaml.maps("links")) {
    const std::size_t i = link_index(rig.chain, link, "link");
    if (seen[i]) link.fail("link", "there twice");
    seen[i] = 1;
    rig.chain.links[i] = parameters_of(read_body(link));
    read_shown(link, kNotShown, Shown::not_at_all, i, rig);
    read_shown(link, kInSums, Shown::in_others, i, rig);
  }
  if (std::find(seen.begin(), seen.end(), 0) != seen.end())
    yaml.fail("links", "must name all links that move");
}

void read_payload(const YamlReader& yaml, ArmRig& rig) {
  Payload payload;
  payload.link = rig.chain.joints[link_index(rig.chain, yaml, "link")].link;
  payload.sign = yaml.boolean_or("removed", false) ? -1 : 1;
  payload.parameters = parameters_of(read_body(yaml));
  rig.payloads.push_back(payload);
}

HeldJoints read_held(const YamlReader& yaml) {
  HeldJoints held;
  for (const std::string& joint : yaml.keys()) held[joint] = yaml.number(joint, Range::any());
  return held;
}

std::string path_in(const std::string& folder, const std::string& path) {
  const std::filesystem::path p(path);
  return p.is_absolute() ? path : (std::filesystem::path(folder) / p).string();
}

void read_drives(const YamlReader& yaml, ArmRig& rig) {
  const YamlReader drive = yaml.map("drives");
  rig.channel =
      record::channel_from_name(drive.choice("channel", {"motor_current", "motor_torque", "output_torque"}));
  for (const std::string& name : drive.texts("terms")) {
    const std::vector<std::string> known = term_names();
    if (std::find(known.begin(), known.end(), name) == known.end())
      drive.fail("terms", "'" + printable(name) + "': known are " + joined(known));
    rig.terms.push_back(term_of(name));
  }
  rig.common_error = 0;
  if (drive.has("common_uncertainty"))
    rig.common_error = drive.number("common_uncertainty", Range::between(0, 1));
  record::ChannelMap time;
  if (const auto channels = yaml.optional_map("channels")) record::read_time(*channels, time);
  for (const YamlReader& joint : yaml.maps("joints")) {
    rig.joints.push_back(read_joint(joint, time, rig.channel));
    for (std::size_t i = 0; i + 1 < rig.joints.size(); ++i)
      if (rig.joints[i].name == rig.joints.back().name) joint.fail("name", "there twice");
    if (rig.channel != record::Channel::motor_current && rig.joints.back().constant != 1)
      joint.fail("torque_constant", "a torque is recorded: must be 1 or absent");
    if (rig.joints.back().channels.columns.empty() != rig.joints.front().channels.columns.empty())
      joint.fail("channels", "all joints must have columns, or none");
  }
  if (rig.joints.empty()) yaml.fail("joints", "must name at least one");
  for (const JointDrive& joint : rig.joints)
    for (const JointEffect& effect : joint.effects)
      if (is_coupling(effect) && (effect.other == joint.name || !index_of(rig, effect.other)))
        yaml.fail("joints", joint.name + ", effects: '" + printable(effect.other) + "' is no other joint");
}

}  // namespace

double drive_unit(DriveTerm term, const model::JointMoment& now) {
  switch (term) {
    case DriveTerm::rotor_inertia:
      return 0;
    case DriveTerm::coulomb:
      return now.direction;
    case DriveTerm::viscous:
      return now.speed;
    case DriveTerm::quadratic:
      return now.speed * std::fabs(now.speed);
    case DriveTerm::cubic:
      return now.speed * now.speed * now.speed;
    case DriveTerm::offset:
      return 1;
    case DriveTerm::load:
      return now.direction * std::fabs(now.load);
  }
  return 0;
}

double drive_friction(const JointDrive& drive, const model::JointMoment& now) {
  double sum = 0;
  for (std::size_t i = 0; i < kDriveTerms; ++i)
    if (drive.terms[i] != 0) sum += drive.terms[i] * drive_unit(DriveTerm(i), now);
  return sum;
}

std::optional<std::size_t> index_of(const ArmRig& rig, const std::string& joint) {
  for (std::size_t j = 0; j < rig.joints.size(); ++j)
    if (rig.joints[j].name == joint) return j;
  return std::nullopt;
}

double ArmRig::friction_speed(std::size_t joint) const {
  const double own = joints[joint].friction_speed;
  return own > 0 ? own : identification.friction_speed;
}

std::vector<std::string> ArmRig::joint_names() const {
  std::vector<std::string> names;
  for (const JointDrive& joint : joints) names.push_back(joint.name);
  return names;
}

ArmRig arm_rig_of_urdf(const std::string& path, const HeldJoints& held) {
  ArmRig rig;
  rig.source = rig.urdf = path;
  rig.name = std::filesystem::path(path).stem().string();
  rig.channel = record::Channel::motor_torque;
  rig.terms = {DriveTerm::rotor_inertia, DriveTerm::coulomb, DriveTerm::viscous, DriveTerm::offset};
  rig.held = held;
  for (const std::string& name : moving_joints(path, held)) {
    rig.joints.emplace_back();
    rig.joints.back().name = name;
  }
  rig.chain = read_chain(path, rig.joint_names(), held);
  rig.text = arm_rig_text(
      rig,
      {"All joints of " + std::filesystem::path(path).filename().string() +
           " that move. Nothing is known of their drives, all 0: identify finds the values.",
       "For plan_motion a joint may have motion_limits: {lower, upper, speed, acceleration, start} [rad, s].",
       "identification: cutoffs that records of many arms bear [choice]; look at yours."});
  return rig;
}

ArmRig load_arm_rig(const std::string& path) {
  std::ifstream in = open_input(path);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return arm_rig_from_text(text, path, std::filesystem::path(path).parent_path().string());
}

ArmRig arm_rig_from_text(const std::string& text, const std::string& source, const std::string& folder) {
  const YamlReader yaml = YamlReader::from_text(text, source);
  ArmRig rig;
  rig.source = source;
  rig.text = text;
  yaml.integer("schema_version", kSchema, kSchema);
  rig.name = yaml.text("name");
  rig.urdf = path_in(folder, yaml.text("urdf"));
  read_drives(yaml, rig);
  rig.identification = read_identification(yaml.map("identification"));
  if (const auto held = yaml.optional_map("held_joints")) rig.held = read_held(*held);
  rig.chain = read_chain(rig.urdf, rig.joint_names(), rig.held);
  rig.chain.gravity = vector(yaml, "gravity");
  if (yaml.has("links")) {
    read_links(yaml, rig);
    rig.fitted = true;
  }
  if (yaml.has("payloads"))
    for (const YamlReader& payload : yaml.maps("payloads")) read_payload(payload, rig);
  for (std::size_t i = 0; i < rig.chain.size(); ++i)
    if (!is_consistent(rig.chain.links[i]))
      throw BadData(rig.urdf, "link '" + rig.chain.joints[i].link +
                                  "': no body has such an inertia (mass > 0 is needed)");
  yaml.ignore("simulation");  // as above
  yaml.finish();
  return rig;
}

namespace {

std::string body_text(const BodyParameters& parameters) {
  const Body b = body_of(parameters);
  return fmt::format(
      "mass: {:.8g}, centre: [{:.8g}, {:.8g}, {:.8g}],\n     inertia: [{:.10g}, {:.10g}, {:.10g}, {:.10g}, "
      "{:.10g}, {:.10g}]",
      b.mass, b.centre.x(), b.centre.y(), b.centre.z(), b.inertia(0, 0), b.inertia(0, 1), b.inertia(0, 2),
      b.inertia(1, 1), b.inertia(1, 2), b.inertia(2, 2));
}

/// What the motions do not show of a link, as read_shown() reads it.
std::string shown_text(const ArmRig& rig, std::size_t link, const char* key, Shown as) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < 10 && !rig.shown.empty(); ++i)
    if (rig.shown[10 * link + i] == as) names.emplace_back(kStandardNames[i]);
  return names.empty() ? "" : fmt::format(",\n     {}: [{}]", key, joined(names));
}

std::string joint_text(const ArmRig& rig, const JointDrive& joint) {
  std::string text = "  - name: " + joint.name + "\n";
  if (rig.channel == record::Channel::motor_current) {
    text += joint.constant_error > 0
                ? fmt::format("    torque_constant: {{value: {:.8g}, uncertainty: {:.3g} %}}  # N m/A\n",
                              joint.constant, 100 * joint.constant_error)
                : fmt::format("    torque_constant: {:.8g}  # N m/A\n", joint.constant);
  }
  for (const DriveTerm term : rig.terms) {
    const DriveTermSpec& spec = kDriveTermSpecs[std::size_t(term)];
    const double value = joint.terms[std::size_t(term)];
    text += term == DriveTerm::load && joint.load_error > 0
                ? fmt::format("    {}: {{value: {:.8g}, uncertainty: {:.3g}}}  # {}\n", spec.name, value,
                              joint.load_error, spec.unit)
                : fmt::format("    {}: {:.8g}  # {}\n", spec.name, value, spec.unit);
  }
  if (joint.friction_speed > 0)
    text += fmt::format("    friction_speed: {:.8g}  # rad/s\n", joint.friction_speed);
  if (joint.friction_distance > 0)
    text += fmt::format("    friction_distance: {:.8g}  # rad\n", joint.friction_distance);
  if (!joint.channels.columns.empty())
    text += "    channels:\n" + record::columns_text(joint.channels, "      ");
  if (joint.training_error > 0)
    text += fmt::format("    training_error: {:.4g}  # relative\n", joint.training_error);
  if (!joint.effects.empty()) text += "    effects:\n";
  for (const JointEffect& effect : joint.effects) text += "      - " + joint_effect_text(effect) + "\n";
  return text + fmt::format("    delay: {:.6g}  # s\n", joint.delay);
}

}  // namespace

std::string arm_rig_text(const ArmRig& rig, const std::vector<std::string>& comments) {
  std::string text;
  for (const std::string& comment : comments) text += "# " + comment + "\n";
  std::string terms;
  for (const DriveTerm term : rig.terms)
    terms += std::string(terms.empty() ? "" : ", ") + kDriveTermSpecs[std::size_t(term)].name;
  text += fmt::format(
      "schema_version: {}\nname: {}\nurdf: \"{}\"\ngravity: [{:.8g}, {:.8g}, {:.8g}]  # m/s^2, in the "
      "base\n\n",
      kSchema, rig.name, std::filesystem::absolute(rig.urdf).lexically_normal().string(),
      rig.chain.gravity.x(), rig.chain.gravity.y(), rig.chain.gravity.z());
  if (!rig.held.empty()) {
    text += "held_joints:  # that stand still: rad; m of a prismatic one\n";
    for (const auto& [joint, position] : rig.held)
      text += fmt::format("  \"{}\": {}\n", joint, to_text(position));
    text += "\n";
  }
  if (!rig.joints.empty() && !rig.joints.front().channels.columns.empty())
    text += "channels:\n  " + record::time_column_text(rig.joints.front().channels) + "\n\n";
  text += fmt::format("drives:\n  channel: {}\n  terms: [{}]\n", record::channel_name(rig.channel), terms);
  if (rig.common_error > 0)
    text += fmt::format("  common_uncertainty: {:.4g}  # relative, of all torque constants together\n",
                        rig.common_error);
  const ArmIdentification& s = rig.identification;
  text += fmt::format(
      "\nidentification: {{kinematics_cutoff: {:.8g}, torque_cutoff: {:.8g}, slowest: {:.8g}, "
      "friction_speed: {:.8g}}}\n\njoints:\n",
      s.kinematics_cutoff, s.torque_cutoff, s.slowest, s.friction_speed);
  for (const JointDrive& joint : rig.joints) text += joint_text(rig, joint);
  if (rig.fitted) {
    text +=
        "\nlinks:  # kg, m, kg m^2; in the frame of the joint that turns them; inertia about the centre: xx, "
        "xy, xz, yy, yz, zz;\n  # not_shown: no motion shows it; in_sums: only in a sum with others\n";
    for (std::size_t i = 0; i < rig.chain.size(); ++i)
      text += "  - {link: " + rig.chain.joints[i].link + ", " + body_text(rig.chain.links[i]) +
              shown_text(rig, i, kNotShown, Shown::not_at_all) +
              shown_text(rig, i, kInSums, Shown::in_others) + "}\n";
  }
  if (!rig.payloads.empty()) text += "\npayloads:\n";
  for (const Payload& p : rig.payloads)
    text += "  - {link: " + p.link + ", " + (p.sign < 0 ? "removed: true, " : "") + body_text(p.parameters) +
            "}\n";
  return text;
}

std::string standard_name(const Chain& chain, std::size_t index) {
  return chain.joints[index / 10].link + "/" + kStandardNames[index % 10];
}

Chain loaded_chain(const ArmRig& rig) {
  Chain chain = rig.chain;
  for (const Payload& payload : rig.payloads)
    for (std::size_t i = 0; i < chain.size(); ++i)
      if (chain.joints[i].link == payload.link) chain.links[i] += payload.sign * payload.parameters;
  return chain;
}

}  // namespace backlash::arm
