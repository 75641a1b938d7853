// SPDX-License-Identifier: BSD-3-Clause
#include "identified_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/text.h"

namespace backlash::arm_findings {
namespace {

constexpr double kSameValue = 1e-9;  // of the size of a value; choice: such a change is rounding

arm::BodyParameters in_frame(const arm::BodyParameters& parameters, const Eigen::Isometry3d& frame) {
  return arm::parameters_of(arm::moved(arm::body_of(parameters), frame.linear(), frame.translation()));
}

}  // namespace

std::string number(double value) {
  return fmt::format("{:.8g}", value);
}

std::string numbers(const Eigen::Vector3d& v) {
  return number(v.x()) + " " + number(v.y()) + " " + number(v.z());
}

std::string tag(const std::string& name, const Attributes& attributes) {
  std::string text = "<" + name;
  for (const auto& [key, value] : attributes) text += " " + key + "=\"" + value + "\"";
  return text + "/>";
}

IdentifiedWriter::IdentifiedWriter(const std::string& text, std::string source,
                                   const geared_arm::GearedArm& arm)
    : text_(text),
      source_(std::move(source)),
      arm_(arm),
      rig_(arm.rig),
      root_(parse_xml(text, source_)),
      changes_(text) {}

IdentifiedModel IdentifiedWriter::write() {
  read_chain();
  for (std::size_t i = 0; i < rig_.chain.size(); ++i) write_link(i);
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) write_joint(j);
  out_.text = changes_.result();
  return std::move(out_);
}

void IdentifiedWriter::write_link(std::size_t i) {
  const FileLink file = link(i);
  if (!rig_.fitted) return out_.kept.push_back(file.name + ": the rig file has no identified links");
  const arm::BodyParameters now = with_the_files_own(i, file) - file.carried;
  if (!arm::is_consistent(now))
    return out_.kept.push_back(fmt::format(
        "{}: what is fixed to it weighs {:.4g} kg by the file, which leaves no physical body of the "
        "identified {:.4g} kg",
        file.name, file.carried[0], rig_.chain.links[i][0]));
  note_what_is_in_sums(i, file.name);
  const arm::Body body = arm::body_of(now);
  BodyChange change;
  change.mass = std::fabs(body.mass - file.own.mass) > kSameValue * body.mass;
  // 1 mm: the centre of a body that is centred at its joint has no size of its own; choice
  change.centre = (body.centre - file.own.centre).norm() > kSameValue * std::max(1e-3, body.centre.norm());
  change.inertia = (body.inertia - file.own.inertia).norm() > kSameValue * body.inertia.norm();
  if (!change.mass && !change.centre && !change.inertia) return;
  write_body(file, body, change);
  std::vector<std::string> what;
  if (change.mass) what.emplace_back("mass");
  if (change.centre) what.emplace_back("centre");
  if (change.inertia) what.emplace_back("inertia");
  out_.written.push_back(file.name + ": " + joined(what) +
                         (file.inertial == nullptr ? " (it had none)" : ""));
}

/// The identified body in the file's frame. A parameter that no motion shows is free: it is the file's.
arm::BodyParameters IdentifiedWriter::with_the_files_own(std::size_t i, const FileLink& file) {
  const arm::BodyParameters& identified = rig_.chain.links[i];
  const arm::BodyParameters in_file = arm::parameters_of(file.own) + file.carried;
  std::vector<std::string> free;
  arm::BodyParameters now = identified, before = identified;
  if (in_file[0] > 0) before = in_frame(in_file, file.rig_frame.inverse());
  for (std::size_t k = 0; k < 10 && !rig_.shown.empty(); ++k) {
    if (rig_.shown[10 * i + k] != arm::Shown::not_at_all) continue;
    free.emplace_back(arm::kStandardNames[k]);
    now[Eigen::Index(k)] = before[Eigen::Index(k)];
  }
  if (free.empty()) return in_frame(identified, file.rig_frame);
  const arm::BodyParameters result = in_frame(now, file.rig_frame);
  if (in_file[0] > 0 && arm::is_consistent(now) && arm::is_consistent(result - file.carried)) {
    out_.kept.push_back(file.name + ": " + joined(free) + ": no motion shows it");
    return result;
  }
  out_.written.push_back(file.name + ": " + joined(free) +
                         " of the rig file: no motion shows it, but with this file's no body has the rest");
  return in_frame(identified, file.rig_frame);
}

void IdentifiedWriter::note_what_is_in_sums(std::size_t i, const std::string& link) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < 10 && !rig_.shown.empty(); ++k)
    if (rig_.shown[10 * i + k] == arm::Shown::in_others) names.emplace_back(arm::kStandardNames[k]);
  if (!names.empty())
    out_.kept.push_back(link + ": " + joined(names) +
                        ": known in a sum with others only, as near to the values of " + rig_.urdf +
                        " as that sum allows");
}

void IdentifiedWriter::write_joint(std::size_t j) {
  const arm::JointDrive& drive = rig_.joints[j];
  if (rig_.fitted && !(drive.training_error > 0))
    out_.kept.push_back(drive.name + ": it did not move long enough, its friction is not known");
  else
    write_friction(j);
  if (const auto& gear = arm_.joints[j].gear; gear && gear->backlash > 0) write_play(j, gear->backlash);
  finish_joint(j);
  note_unsaid(drive);
}

void IdentifiedWriter::write_friction(std::size_t j) {
  const arm::JointDrive& drive = rig_.joints[j];
  Attributes values;
  std::vector<std::string> what;
  for (const arm::DriveTerm term :
       {arm::DriveTerm::viscous, arm::DriveTerm::coulomb, arm::DriveTerm::rotor_inertia}) {
    const char* const attribute = attribute_of(term);
    const double value = drive.terms[std::size_t(term)];
    if (attribute == nullptr || std::find(rig_.terms.begin(), rig_.terms.end(), term) == rig_.terms.end())
      continue;
    if (value < 0) {
      out_.kept.push_back(fmt::format(
          "{}: {} comes out as {:.3g}, which no such file may have: terms of higher order beside it "
          "make the friction",
          drive.name, attribute, value));
      continue;
    }
    values.emplace_back(attribute, number(value));
    what.emplace_back(attribute);
  }
  if (!values.empty() && write_drive(j, values)) out_.written.push_back(drive.name + ": " + joined(what));
}

void IdentifiedWriter::note_unsaid(const arm::JointDrive& drive) {
  std::vector<std::string> what;
  for (const arm::DriveTerm term : rig_.terms) {
    const arm::DriveTermSpec& spec = arm::kDriveTermSpecs[std::size_t(term)];
    const double value = drive.terms[std::size_t(term)];
    if (attribute_of(term) == nullptr && value != 0)
      what.push_back(fmt::format("{} {:.4g} {}", spec.name, value, spec.unit));
  }
  for (const arm::JointEffect& effect : drive.effects) what.push_back(effect.id);
  if (!what.empty()) out_.unsaid.push_back(drive.name + ": " + joined(what));
}

}  // namespace backlash::arm_findings
