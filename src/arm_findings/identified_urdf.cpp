// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm_findings/identified_urdf.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <sstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "xml_text.h"

namespace backlash::arm_findings {
namespace {

constexpr double kSamePlace = 1e-6;  // m, and of a rotation; choice: rounding of a printed file
constexpr double kSameValue = 1e-9;  // of the size of a value; choice: such a change is rounding

using Attributes = std::vector<std::pair<std::string, std::string>>;

std::string number(double value) {
  return fmt::format("{:.8g}", value);
}

std::string numbers(const Eigen::Vector3d& v) {
  return number(v.x()) + " " + number(v.y()) + " " + number(v.z());
}

Eigen::Vector3d vector(const std::string& text) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  in >> v.x() >> v.y() >> v.z();
  return v;
}

/// URDF: rotation about the fixed axes x, y, z by roll, pitch, yaw.
Eigen::Matrix3d rotation_of(const Eigen::Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

/// What an inertial element says, in the frame of its link; its own axes beside it.
struct Inertial {
  arm::Body body;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
};

double attribute_number(const XmlElement* element, const char* name) {
  if (element == nullptr) return 0;
  const ParsedNumber parsed = parse_number(std::string(trimmed(element->attribute(name))));
  return parsed ? parsed.value : 0;
}

Inertial inertial_of(const XmlElement* element) {
  Inertial out;
  if (element == nullptr) return out;
  if (const XmlElement* origin = element->child("origin")) {
    out.body.centre = vector(origin->attribute("xyz"));
    out.axes = rotation_of(vector(origin->attribute("rpy")));
  }
  out.body.mass = attribute_number(element->child("mass"), "value");
  const auto in = [&](const char* name) { return attribute_number(element->child("inertia"), name); };
  Eigen::Matrix3d i;
  i << in("ixx"), in("ixy"), in("ixz"), in("ixy"), in("iyy"), in("iyz"), in("ixz"), in("iyz"), in("izz");
  out.body.inertia = out.axes * i * out.axes.transpose();
  return out;
}

Attributes inertia_attributes(const Eigen::Matrix3d& i) {
  return {{"ixx", number(i(0, 0))}, {"ixy", number(i(0, 1))}, {"ixz", number(i(0, 2))},
          {"iyy", number(i(1, 1))}, {"iyz", number(i(1, 2))}, {"izz", number(i(2, 2))}};
}

std::string tag(const std::string& name, const Attributes& attributes) {
  std::string text = "<" + name;
  for (const auto& [key, value] : attributes) text += " " + key + "=\"" + value + "\"";
  return text + "/>";
}

class Writer {
 public:
  Writer(const std::string& text, const std::string& source, const geared_arm::GearedArm& arm)
      : source_(source), arm_(arm), rig_(arm.rig), root_(parse_xml(text, source)), changes_(text) {}

  IdentifiedUrdf run(const std::string& text) {
    const arm::Chain chain = arm::chain_of_urdf(text, source_, rig_.joint_names(), rig_.held);
    require_same_robot(chain);
    for (std::size_t i = 0; i < chain.size(); ++i) write_link(i, chain);
    for (std::size_t i = 0; i < chain.size(); ++i) write_joint(i);
    out_.text = changes_.result();
    return std::move(out_);
  }

 private:
  const XmlElement& named(const char* kind, const std::string& name) const {
    for (const auto& child : root_->children)
      if (child->name == kind && child->attribute("name") == name) return *child;
    throw BadData(source_, std::string("no ") + kind + " '" + printable(name) + "' at its top");
  }

  void require_same_robot(const arm::Chain& chain) const {
    for (std::size_t i = 0; i < chain.size(); ++i) {
      const arm::Joint &a = chain.joints[i], &b = rig_.chain.joints[i];
      const double off = std::max({(a.position - b.position).norm(), (a.rotation - b.rotation).norm(),
                                   (a.axis - b.axis).norm(), a.link == b.link ? 0.0 : 1.0});
      if (off > kSamePlace)
        throw BadData(source_, "joint '" + a.name + "' is not where that of the rig file's robot (" +
                                   rig_.urdf +
                                   ") is, or turns another link: its values are those of another robot");
    }
  }

  void write_link(std::size_t i, const arm::Chain& chain) {
    const std::string& name = chain.joints[i].link;
    if (!rig_.fitted) return out_.kept.push_back(name + ": the rig file has no identified links");
    const XmlElement& link = named("link", name);
    const XmlElement* const element = link.child("inertial");
    const Inertial before = inertial_of(element);
    const arm::BodyParameters own = arm::parameters_of(before.body);
    const arm::BodyParameters carried = chain.links[i] - own;  // by fixed joints
    const arm::BodyParameters now = rig_.chain.links[i] - carried;
    if (!arm::is_consistent(now))
      return out_.kept.push_back(fmt::format(
          "{}: what is fixed to it weighs {:.4g} kg by the file, which leaves no physical body of the "
          "identified {:.4g} kg",
          name, carried[0], rig_.chain.links[i][0]));
    note_what_is_not_shown(i);
    write_body(link, element, before, arm::body_of(now));
  }

  void note_what_is_not_shown(std::size_t i) {
    if (rig_.shown.empty()) return;
    std::string not_shown, in_sums;
    for (std::size_t k = 0; k < 10; ++k) {
      const arm::Shown shown = rig_.shown[10 * i + k];
      if (shown == arm::Shown::leads) continue;
      std::string& list = shown == arm::Shown::not_at_all ? not_shown : in_sums;
      list += std::string(list.empty() ? "" : ", ") + arm::kStandardNames[k];
    }
    const std::string link = rig_.chain.joints[i].link + ": ";
    if (!not_shown.empty()) out_.kept.push_back(link + not_shown + ": no motion shows it");
    if (!in_sums.empty())
      out_.kept.push_back(
          link + in_sums +
          ": known in a sum with others only, as near to the file's values as that sum allows");
  }

  static bool same(double a, double b, double size) { return std::fabs(a - b) <= kSameValue * size; }

  void write_body(const XmlElement& link, const XmlElement* element, const Inertial& before,
                  const arm::Body& now) {
    const Eigen::Matrix3d in_axes = before.axes.transpose() * now.inertia * before.axes,
                          old_in_axes = before.axes.transpose() * before.body.inertia * before.axes;
    const Attributes mass = {{"value", number(now.mass)}}, inertia = inertia_attributes(in_axes),
                     origin = {{"xyz", numbers(now.centre)}};
    const std::string name = link.attribute("name");
    if (element == nullptr) {
      changes_.add_first(link, {"<inertial>", "  " + tag("origin", origin), "  " + tag("mass", mass),
                                "  " + tag("inertia", inertia), "</inertial>"});
      return out_.written.push_back(name + ": mass, centre, inertia (it had none)");
    }
    std::vector<std::string> missing, what;
    const auto set = [&](const char* child, const Attributes& values, const char* word) {
      what.emplace_back(word);
      if (const XmlElement* c = element->child(child))
        changes_.set_attributes(*c, values);
      else
        missing.push_back(tag(child, values));
    };
    const double size = std::max(1e-3, now.centre.norm());
    if ((now.centre - before.body.centre).norm() > kSameValue * size) set("origin", origin, "centre");
    if (!same(now.mass, before.body.mass, now.mass)) set("mass", mass, "mass");
    if ((in_axes - old_in_axes).norm() > kSameValue * in_axes.norm()) set("inertia", inertia, "inertia");
    if (!missing.empty()) changes_.add_last(*element, missing);
    if (!what.empty()) out_.written.push_back(name + ": " + joined(what));
  }

  void write_joint(std::size_t j) {
    const arm::JointDrive& drive = rig_.joints[j];
    const XmlElement& joint = named("joint", drive.name);
    std::vector<std::string> lines;
    if (rig_.fitted && !(drive.training_error > 0))
      out_.kept.push_back(drive.name + ": it did not move long enough, its friction is not known");
    else
      write_friction(joint, drive, lines);
    if (const auto& gear = arm_.joints[j].gear; gear && gear->backlash > 0) {
      lines.push_back("<!-- play: " + number(gear->backlash) + " rad, wall to wall -->");
      out_.written.push_back(drive.name + ": play, as a comment: URDF has no element for it");
    }
    if (!lines.empty()) changes_.add_last(joint, lines);
    note_unsaid(drive);
  }

  bool has_term(arm::DriveTerm term) const {
    return std::find(rig_.terms.begin(), rig_.terms.end(), term) != rig_.terms.end();
  }

  void write_friction(const XmlElement& joint, const arm::JointDrive& drive,
                      std::vector<std::string>& lines) {
    Attributes values;
    std::vector<std::string> what;
    const auto set = [&](const char* attribute, arm::DriveTerm term) {
      const double value = drive.terms[std::size_t(term)];
      if (!has_term(term)) return;
      if (value < 0)
        return out_.kept.push_back(
            fmt::format("{}: {} comes out as {:.3g}, which no URDF may have: terms of higher order beside it "
                        "make the friction",
                        drive.name, attribute, value));
      values.emplace_back(attribute, number(value));
      what.emplace_back(attribute);
    };
    set("damping", arm::DriveTerm::viscous);
    set("friction", arm::DriveTerm::coulomb);
    if (values.empty()) return;
    if (const XmlElement* dynamics = joint.child("dynamics"))
      changes_.set_attributes(*dynamics, values);
    else
      lines.push_back(tag("dynamics", values));
    out_.written.push_back(drive.name + ": " + joined(what));
  }

  void note_unsaid(const arm::JointDrive& drive) {
    std::vector<std::string> what;
    for (const arm::DriveTerm term : rig_.terms) {
      const arm::DriveTermSpec& spec = arm::kDriveTermSpecs[std::size_t(term)];
      const double value = drive.terms[std::size_t(term)];
      if (term == arm::DriveTerm::coulomb || term == arm::DriveTerm::viscous || value == 0) continue;
      what.push_back(fmt::format("{} {:.4g} {}", spec.name, value, spec.unit));
    }
    for (const arm::JointEffect& effect : drive.effects) what.push_back(effect.id);
    if (!what.empty()) out_.unsaid.push_back(drive.name + ": " + joined(what));
  }

  const std::string& source_;
  const geared_arm::GearedArm& arm_;
  const arm::ArmRig& rig_;
  std::unique_ptr<XmlElement> root_;
  TextChanges changes_;
  IdentifiedUrdf out_;
};

}  // namespace

IdentifiedUrdf identified_urdf(const std::string& text, const std::string& source,
                               const geared_arm::GearedArm& arm) {
  return Writer(text, source, arm).run(text);
}

}  // namespace backlash::arm_findings
