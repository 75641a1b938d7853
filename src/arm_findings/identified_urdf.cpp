// SPDX-License-Identifier: BSD-3-Clause
#include <sstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "identified_writer.h"

namespace backlash::arm_findings {
namespace {

constexpr double kSamePlace = 1e-6;  // m, and of a rotation; choice: rounding of a printed file

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

/// The axes of an inertia, in the frame of its link.
Eigen::Matrix3d axes_of(const XmlElement* inertial) {
  const XmlElement* const origin = inertial == nullptr ? nullptr : inertial->child("origin");
  return rotation_of(origin == nullptr ? Eigen::Vector3d::Zero() : vector(origin->attribute("rpy")));
}

double attribute_number(const XmlElement* element, const char* name) {
  if (element == nullptr) return 0;
  const ParsedNumber parsed = parse_number(std::string(trimmed(element->attribute(name))));
  return parsed ? parsed.value : 0;
}

arm::Body body_of_element(const XmlElement* element) {
  arm::Body body;
  if (element == nullptr) return body;
  if (const XmlElement* origin = element->child("origin")) body.centre = vector(origin->attribute("xyz"));
  body.mass = attribute_number(element->child("mass"), "value");
  const auto in = [&](const char* name) { return attribute_number(element->child("inertia"), name); };
  Eigen::Matrix3d i;
  i << in("ixx"), in("ixy"), in("ixz"), in("ixy"), in("iyy"), in("iyz"), in("ixz"), in("iyz"), in("izz");
  body.inertia = axes_of(element) * i * axes_of(element).transpose();
  return body;
}

Attributes inertia_attributes(const Eigen::Matrix3d& i) {
  return {{"ixx", number(i(0, 0))}, {"ixy", number(i(0, 1))}, {"ixz", number(i(0, 2))},
          {"iyy", number(i(1, 1))}, {"iyz", number(i(1, 2))}, {"izz", number(i(2, 2))}};
}

class UrdfWriter : public IdentifiedWriter {
 public:
  using IdentifiedWriter::IdentifiedWriter;

 private:
  const XmlElement& named(const char* kind, const std::string& name) const {
    for (const auto& child : root_->children)
      if (child->name == kind && child->attribute("name") == name) return *child;
    throw BadData(source_, std::string("no ") + kind + " '" + printable(name) + "' at its top");
  }

  void read_chain() override {
    chain_ = arm::chain_of_urdf(text_, source_, rig_.joint_names(), rig_.held);
    for (std::size_t i = 0; i < chain_.size(); ++i) {
      const arm::Joint &a = chain_.joints[i], &b = rig_.chain.joints[i];
      const double off = std::max({(a.position - b.position).norm(), (a.rotation - b.rotation).norm(),
                                   (a.axis - b.axis).norm(), a.link == b.link ? 0.0 : 1.0});
      if (off > kSamePlace)
        throw BadData(source_, "joint '" + a.name + "' is not where that of the rig file's robot (" +
                                   rig_.urdf +
                                   ") is, or turns another link: its values are those of another robot");
    }
  }

  FileLink link(std::size_t i) const override {
    FileLink out;
    out.name = chain_.joints[i].link;
    out.element = &named("link", out.name);
    out.inertial = out.element->child("inertial");
    out.own = body_of_element(out.inertial);
    out.carried = chain_.links[i] - arm::parameters_of(out.own);
    return out;
  }

  void write_body(const FileLink& link, const arm::Body& now, BodyChange change) override {
    const Eigen::Matrix3d axes = axes_of(link.inertial);
    const Attributes mass = {{"value", number(now.mass)}}, origin = {{"xyz", numbers(now.centre)}},
                     inertia = inertia_attributes(axes.transpose() * now.inertia * axes);
    if (link.inertial == nullptr)
      return changes_.add_first(*link.element,
                                {"<inertial>", "  " + tag("origin", origin), "  " + tag("mass", mass),
                                 "  " + tag("inertia", inertia), "</inertial>"});
    std::vector<std::string> missing;
    const auto set = [&](bool changed, const char* child, const Attributes& values) {
      if (!changed) return;
      if (const XmlElement* c = link.inertial->child(child))
        changes_.set_attributes(*c, values);
      else
        missing.push_back(tag(child, values));
    };
    set(change.centre, "origin", origin);
    set(change.mass, "mass", mass);
    set(change.inertia, "inertia", inertia);
    if (!missing.empty()) changes_.add_last(*link.inertial, missing);
  }

  const char* attribute_of(arm::DriveTerm term) const override {
    return term == arm::DriveTerm::viscous   ? "damping"
           : term == arm::DriveTerm::coulomb ? "friction"
                                             : nullptr;
  }

  bool write_drive(std::size_t j, const Attributes& values) override {
    if (const XmlElement* dynamics = named("joint", rig_.joints[j].name).child("dynamics"))
      changes_.set_attributes(*dynamics, values);
    else
      lines_.push_back(tag("dynamics", values));
    return true;
  }

  void write_play(std::size_t j, double play) override {
    lines_.push_back("<!-- play: " + number(play) + " rad, wall to wall -->");
    out_.written.push_back(rig_.joints[j].name + ": play, as a comment: URDF has no element for it");
  }

  void finish_joint(std::size_t j) override {
    if (!lines_.empty()) changes_.add_last(named("joint", rig_.joints[j].name), lines_);
    lines_.clear();
  }

  arm::Chain chain_;
  std::vector<std::string> lines_;  // for the end of the joint
};

}  // namespace

IdentifiedModel identified_urdf(const std::string& text, const std::string& source,
                                const geared_arm::GearedArm& arm) {
  return UrdfWriter(text, source, arm).write();
}

}  // namespace backlash::arm_findings
