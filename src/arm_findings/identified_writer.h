// SPDX-License-Identifier: BSD-3-Clause
// What the writers of identified_model.h share: which values of the fitted rig go into the file, which keep
// the file's, and what is said of both. A format says where its values stand.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/arm_findings/identified_model.h"
#include "xml_text.h"

namespace backlash::arm_findings {

using Attributes = std::vector<std::pair<std::string, std::string>>;

std::string number(double value);
std::string numbers(const Eigen::Vector3d& v);
/// <name key="value" .../>
std::string tag(const std::string& name, const Attributes& attributes);

/// A link of the chain as the file has it, in the file's frame.
struct FileLink {
  std::string name;
  const XmlElement* element = nullptr;                          // of the link
  const XmlElement* inertial = nullptr;                         // null: it has none
  arm::Body own;                                                // what `inertial` says
  arm::BodyParameters carried = arm::BodyParameters::Zero();    // of what stands still on it
  Eigen::Isometry3d rig_frame = Eigen::Isometry3d::Identity();  // the frame of the rig's link in this one
};

/// What of a link's body changes.
struct BodyChange {
  bool mass = false, centre = false, inertia = false;
};

class IdentifiedWriter {
 public:
  IdentifiedWriter(const std::string& text, std::string source, const geared_arm::GearedArm& arm);
  virtual ~IdentifiedWriter() = default;
  IdentifiedModel write();

 protected:
  /// Reads the file's chain; throws BadData where it is not that of the rig.
  virtual void read_chain() = 0;
  virtual FileLink link(std::size_t i) const = 0;
  virtual void write_body(const FileLink& link, const arm::Body& now, BodyChange change) = 0;
  /// Where a value of a drive stands in a joint; null: it has no place.
  virtual const char* attribute_of(arm::DriveTerm term) const = 0;
  /// Writes values of a drive that are not those of the file; false: none is another.
  virtual bool write_drive(std::size_t j, const Attributes& values) = 0;
  virtual void write_play(std::size_t j, double play) = 0;
  /// After all others, as a line at the end of the joint is.
  virtual void finish_joint(std::size_t) {}

  const std::string& text_;
  const std::string source_;
  const geared_arm::GearedArm& arm_;
  const arm::ArmRig& rig_;
  std::unique_ptr<XmlElement> root_;
  TextChanges changes_;
  IdentifiedModel out_;

 private:
  void write_link(std::size_t i);
  arm::BodyParameters with_the_files_own(std::size_t i, const FileLink& link);
  void note_what_is_in_sums(std::size_t i, const std::string& link);
  void write_joint(std::size_t j);
  void write_friction(std::size_t j);
  void note_unsaid(const arm::JointDrive& drive);
};

}  // namespace backlash::arm_findings
