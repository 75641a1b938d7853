// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/simulator_model.h"

#include <fmt/format.h>

#include "backlash_diagnosis/base/version.h"
#include "simulator_formats.h"

namespace backlash::report {
namespace {

std::string without_breaks(const std::string& text) {
  std::string line;
  for (const char c : text) line += c == '\n' || c == '\r' ? ' ' : c;
  return line;
}

}  // namespace

std::string xml_text(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const char* entity = c == '&'   ? "&amp;"
                         : c == '<' ? "&lt;"
                         : c == '>' ? "&gt;"
                         : c == '"' ? "&quot;"
                                    : nullptr;
    if (entity != nullptr)
      out += entity;
    else
      out += c;
  }
  return out;
}

/// Two hyphens end a comment.
std::string xml_comment(const std::string& text) {
  std::string out;
  for (const char c : without_breaks(text)) {
    if (c == '-' && !out.empty() && out.back() == '-') out += ' ';
    out += c;
  }
  return "<!-- " + out + " -->\n";
}

std::string about(const rig_file::RigFile& file, const JointModel& joint, const std::string& indent) {
  std::string text =
      indent +
      xml_comment(fmt::format("{}, joint {}: exported by backlash_diagnosis {} from a rig file of digest {}",
                              file.rig.name, joint.name, version(), file.digest));
  text += indent +
          xml_comment(fmt::format(
              "Everything is at the load side of the reduction (ratio {}): angle of the motor divided by it, "
              "torque multiplied by it.",
              joint.ratio));
  for (const std::string& what : joint.unsaid) text += indent + xml_comment("Not said here: " + what);
  return text;
}

JointInertia inertia_of(const JointModel& joint, bool last) {
  const JointBody& body = last ? joint.last() : joint.motor;
  if (joint.linear) return {body.inertia, 1e-6 * body.inertia, 0, 0};
  if (!last || !joint.gravity) return {1, body.inertia, 0, 0};
  // A mass that weighs as the load does, so close to the axis that it takes half of the inertia.
  const double arm = 0.5 * body.inertia * kGravity / joint.gravity->amplitude;
  return {joint.gravity->amplitude / (kGravity * arm), 0.5 * body.inertia,
          -arm * std::sin(joint.gravity->phase), -arm * std::cos(joint.gravity->phase)};
}

SimulatorModel simulator_model(const rig_file::RigFile& file, SimulatorFormat format,
                               std::optional<double> torque) {
  JointModel joint = joint_model(file, torque);
  std::string text;
  switch (format) {
    case SimulatorFormat::mjcf:
      text = mjcf(file, joint);
      break;
    case SimulatorFormat::urdf:
      text = urdf(file, joint);
      break;
    case SimulatorFormat::sdf:
      text = sdf(file, joint);
      break;
  }
  return {std::move(text), std::move(joint.unsaid)};
}

}  // namespace backlash::report
