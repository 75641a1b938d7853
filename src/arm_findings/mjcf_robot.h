// SPDX-License-Identifier: BSD-3-Clause
// The bodies and joints of a MuJoCo file, with what its default classes give them.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/chain.h"
#include "xml_text.h"

namespace backlash::arm_findings {

struct MjcfBody {
  const XmlElement* element = nullptr;
  std::optional<std::size_t> parent;                        // none: the world
  std::string name;                                         // or that of its joint
  std::string childclass;                                   // for what is in it
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();  // in the parent, its joints as drawn
  std::vector<const XmlElement*> joints;
  const XmlElement* inertial = nullptr;
};

class MjcfRobot {
 public:
  /// Throws BadData where what stands in the file is not what MuJoCo takes: included files, frames, global
  /// coordinates, masses by geoms alone or scaled to a total.
  MjcfRobot(const XmlElement& root, std::string source);

  const std::vector<MjcfBody>& bodies() const { return bodies_; }
  /// As written or as a default class has it; empty: neither.
  std::string value(const XmlElement& element, const MjcfBody& body, const std::string& name) const;
  /// Numbers of such a value; `usual`: as many where there is none.
  std::vector<double> values(const XmlElement& element, const MjcfBody& body, const std::string& name,
                             const std::vector<double>& usual) const;
  /// The axis of a joint as a direction and a point of it, in its body's frame.
  Eigen::Vector3d axis(const MjcfBody& body, const XmlElement& joint) const;
  Eigen::Vector3d anchor(const MjcfBody& body, const XmlElement& joint) const;
  /// Where a body of this joint stands in its parent when the joint is at `q` [rad, m].
  Eigen::Isometry3d place(const MjcfBody& body, const XmlElement& joint, double q) const;
  /// What the body's inertial says. Throws BadData where it has none but geoms that weigh.
  arm::Body own(const MjcfBody& body) const;

  [[noreturn]] void refuse(const XmlElement& element, const std::string& why) const;

 private:
  void read_compiler(const XmlElement& compiler);
  void read_defaults(const XmlElement& defaults, const std::string& parent);
  void read_bodies(const XmlElement& element, std::optional<std::size_t> parent,
                   const std::string& childclass);
  std::vector<double> own_numbers(const XmlElement& element, const std::string& name,
                                  std::size_t count) const;
  Eigen::Quaterniond orientation(const XmlElement& element) const;

  struct DefaultClass {
    std::string parent;
    std::vector<const XmlElement*> elements;
  };
  std::string source_, main_class_;
  std::map<std::string, DefaultClass> classes_;
  double angle_unit_;  // rad
  std::string eulerseq_ = "xyz";
  std::vector<MjcfBody> bodies_;
};

}  // namespace backlash::arm_findings
