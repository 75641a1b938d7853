// SPDX-License-Identifier: BSD-3-Clause
#include "mjcf_robot.h"

#include <cctype>
#include <cmath>
#include <sstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::arm_findings {
namespace {

using Eigen::Vector3d;

const char* const kOneFile = "let MuJoCo write the model as one plain file first (mj_saveLastXML)";

Vector3d vector(const std::vector<double>& v) {
  return {v[0], v[1], v[2]};
}

}  // namespace

MjcfRobot::MjcfRobot(const XmlElement& root, std::string source)
    : source_(std::move(source)), angle_unit_(std::atan(1.0) / 45) {
  if (root.name != "mujoco") refuse(root, "is no MuJoCo file: its root is not <mujoco>");
  for (const auto& child : root.children)
    if (child->name == "compiler") read_compiler(*child);
  for (const auto& child : root.children) {
    if (child->name == "include")
      refuse(*child, std::string("what other files hold is not known: ") + kOneFile);
    if (child->name == "default") read_defaults(*child, "");
  }
  for (const auto& child : root.children)
    if (child->name == "worldbody") read_bodies(*child, {}, child->attribute("childclass"));
}

void MjcfRobot::refuse(const XmlElement& element, const std::string& why) const {
  throw BadData(source_ + ":" + std::to_string(element.line), "<" + printable(element.name) + ">: " + why);
}

void MjcfRobot::read_compiler(const XmlElement& compiler) {
  const auto is = [&](const char* name, const char* value) { return compiler.attribute(name) == value; };
  if (is("coordinate", "global")) refuse(compiler, std::string("coordinate = global: ") + kOneFile);
  if (is("inertiafromgeom", "true"))
    refuse(compiler, "inertiafromgeom = true: MuJoCo would not read the written inertias; make it auto");
  if (const std::string total = compiler.attribute("settotalmass"); !total.empty() && total != "-1")
    refuse(compiler,
           "settotalmass = " + printable(total) + ": MuJoCo would scale the written masses; take it out");
  if (is("angle", "radian")) angle_unit_ = 1;
  if (is("angle", "degree")) angle_unit_ = std::atan(1.0) / 45;
  if (const std::string order = compiler.attribute("eulerseq"); !order.empty()) {
    if (order.size() != 3 || order.find_first_not_of("xyzXYZ") != std::string::npos)
      refuse(compiler, "eulerseq = " + printable(order) + ": must be three of xyz or XYZ");
    eulerseq_ = order;
  }
}

void MjcfRobot::read_defaults(const XmlElement& defaults, const std::string& parent) {
  std::string name = defaults.attribute("class");
  if (parent.empty()) main_class_ = name = name.empty() ? "main" : name;
  classes_[name].parent = parent;
  classes_[name].elements.push_back(&defaults);
  for (const auto& child : defaults.children)
    if (child->name == "default") read_defaults(*child, name);
}

void MjcfRobot::read_bodies(const XmlElement& element, std::optional<std::size_t> parent,
                            const std::string& childclass) {
  for (const auto& child : element.children) {
    for (const char* made : {"include", "frame", "replicate", "attach", "composite"})
      if (child->name == made)
        refuse(*child, std::string("bodies that this makes are not known: ") + kOneFile);
    if (child->name != "body") continue;
    MjcfBody body;
    body.element = child.get();
    body.parent = parent;
    body.name = child->attribute("name");
    body.childclass = child->attribute("childclass").empty() ? childclass : child->attribute("childclass");
    if (!child->attribute("pos").empty()) body.place.translation() = vector(own_numbers(*child, "pos", 3));
    body.place.linear() = orientation(*child).toRotationMatrix();
    for (const auto& part : child->children)
      if (part->name == "joint" || part->name == "freejoint") body.joints.push_back(part.get());
    body.inertial = child->child("inertial");
    if (body.name.empty())
      body.name =
          body.joints.empty() ? "a body without name" : "body of " + body.joints[0]->attribute("name");
    bodies_.push_back(body);
    read_bodies(*child, bodies_.size() - 1, body.childclass);
  }
}

std::string MjcfRobot::value(const XmlElement& element, const MjcfBody& body, const std::string& name) const {
  if (const std::string own = element.attribute(name); !own.empty()) return own;
  std::string of = element.attribute("class");
  if (of.empty()) of = body.childclass.empty() ? main_class_ : body.childclass;
  while (!of.empty()) {
    const auto found = classes_.find(of);
    if (found == classes_.end()) refuse(element, "there is no default class '" + printable(of) + "'");
    const auto& places = found->second.elements;
    for (auto place = places.rbegin(); place != places.rend(); ++place)
      if (const XmlElement* given = (*place)->child(element.name))
        if (const std::string inherited = given->attribute(name); !inherited.empty()) return inherited;
    of = found->second.parent;
  }
  return "";
}

std::vector<double> MjcfRobot::values(const XmlElement& element, const MjcfBody& body,
                                      const std::string& name, const std::vector<double>& usual) const {
  const std::string text = value(element, body, name);
  if (text.empty()) return usual;
  std::vector<double> out;
  std::istringstream in(text);
  for (std::string word; in >> word;) {
    const ParsedNumber parsed = parse_number(word);
    if (!parsed) refuse(element, name + " = '" + printable(text) + "': " + parsed.problem);
    out.push_back(parsed.value);
  }
  if (out.size() != usual.size())
    refuse(element,
           name + " = '" + printable(text) + "': must be " + std::to_string(usual.size()) + " numbers");
  return out;
}

/// Of an element that has no defaults.
std::vector<double> MjcfRobot::own_numbers(const XmlElement& element, const std::string& name,
                                           std::size_t count) const {
  XmlElement alone;
  alone.line = element.line;
  alone.name = element.name;
  alone.attributes = {{name, element.attribute(name)}};
  if (element.attribute(name).empty()) refuse(element, "has no " + name);
  return values(alone, {}, name, std::vector<double>(count));
}

Eigen::Quaterniond MjcfRobot::orientation(const XmlElement& e) const {
  const auto has = [&](const char* name) { return !e.attribute(name).empty(); };
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  if (has("quat")) {
    const std::vector<double> v = own_numbers(e, "quat", 4);
    q = Eigen::Quaterniond(v[0], v[1], v[2], v[3]).normalized();
  } else if (has("axisangle")) {
    const std::vector<double> v = own_numbers(e, "axisangle", 4);
    q = Eigen::AngleAxisd(angle_unit_ * v[3], vector(v).normalized());
  } else if (has("xyaxes")) {
    const std::vector<double> v = own_numbers(e, "xyaxes", 6);
    Eigen::Matrix3d axes;
    axes.col(0) = vector(v).normalized();
    const Vector3d y(v[3], v[4], v[5]);
    axes.col(1) = (y - axes.col(0).dot(y) * axes.col(0)).normalized();
    axes.col(2) = axes.col(0).cross(axes.col(1));
    q = Eigen::Quaterniond(axes);
  } else if (has("zaxis")) {
    q = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), vector(own_numbers(e, "zaxis", 3)));
  } else if (has("euler")) {
    const std::vector<double> v = own_numbers(e, "euler", 3);
    for (std::size_t i = 0; i < 3; ++i) {  // small letters: about the axes that have turned
      const int axis = std::tolower(eulerseq_[i]) - 'x';
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle_unit_ * v[i], Vector3d::Unit(axis)));
      q = std::islower(eulerseq_[i]) != 0 ? q * turn : turn * q;
    }
  }
  return q;
}

Vector3d MjcfRobot::axis(const MjcfBody& body, const XmlElement& joint) const {
  const Vector3d direction = vector(values(joint, body, "axis", {0, 0, 1}));
  if (!(direction.norm() > 0)) refuse(joint, "axis = 0 0 0: is no direction");
  return direction.normalized();
}

Vector3d MjcfRobot::anchor(const MjcfBody& body, const XmlElement& joint) const {
  return vector(values(joint, body, "pos", {0, 0, 0}));
}

Eigen::Isometry3d MjcfRobot::place(const MjcfBody& body, const XmlElement& joint, double q) const {
  const bool slides = value(joint, body, "type") == "slide";
  q -= (slides ? 1 : angle_unit_) * values(joint, body, "ref", {0})[0];  // as drawn it is at `ref`
  if (slides) return body.place * Eigen::Translation3d(q * axis(body, joint));
  const Vector3d at = anchor(body, joint);
  return body.place * Eigen::Translation3d(at) * Eigen::AngleAxisd(q, axis(body, joint)) *
         Eigen::Translation3d(-at);
}

arm::Body MjcfRobot::own(const MjcfBody& body) const {
  arm::Body out;
  const XmlElement* const e = body.inertial;
  if (e == nullptr) {
    for (const auto& geom : body.element->children)
      if (geom->name == "geom" && value(*geom, body, "mass") != "0" && value(*geom, body, "density") != "0")
        refuse(*geom, "body '" + printable(body.name) +
                          "' has no inertial, MuJoCo takes its mass from this geom, "
                          "which is not known here: give the body its <inertial>, or the geom mass = 0");
    return out;
  }
  out.mass = own_numbers(*e, "mass", 1)[0];
  out.centre = vector(own_numbers(*e, "pos", 3));
  if (!e->attribute("fullinertia").empty()) {
    const std::vector<double> i = own_numbers(*e, "fullinertia", 6);
    out.inertia << i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2];
  } else {
    const Eigen::Matrix3d axes = orientation(*e).toRotationMatrix();
    out.inertia = axes * vector(own_numbers(*e, "diaginertia", 3)).asDiagonal() * axes.transpose();
  }
  return out;
}

}  // namespace backlash::arm_findings
