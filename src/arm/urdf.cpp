// SPDX-License-Identifier: BSD-3-Clause
// The URDF part of chain.h.
#include <urdf_parser/urdf_parser.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "backlash_diagnosis/arm/chain.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::arm {
namespace {

constexpr std::size_t kLargestUrdf = std::size_t{4} * 1024 * 1024;  // bytes; choice
constexpr double kUnitAxis = 1e-6;                                  // choice: rounding of a printed axis

Eigen::Vector3d vector(const urdf::Vector3& v) {
  return {v.x, v.y, v.z};
}

Eigen::Matrix3d matrix(const urdf::Rotation& r) {
  return Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized().toRotationMatrix();
}

/// A joint's frame in that of the link that it begins at.
struct Place {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d position;
};

class Reader {
 public:
  Reader(const urdf::ModelInterface& model, const std::string& name, const HeldJoints& held)
      : model_(model), name_(name), held_(held) {
    for (const auto& entry : held) check_held(entry.first);
    for (const auto& [joint, j] : model_.joints_)
      if (j->mimic && held.count(joint) == 0)
        if (const auto master = held.find(j->mimic->joint_name); master != held.end()) {
          held_[joint] = j->mimic->multiplier * master->second + j->mimic->offset;
          check_held(joint);
        }
  }

  Chain chain(const std::vector<std::string>& names) const {
    if (names.empty()) throw BadData(name_, "no joints are asked for");
    Chain chain;
    std::vector<std::string> moving;
    for (const std::string& name : names) chain.joints.push_back(joint(name));
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto before = model_.getJoint(names[i])->parent_link_name;
      const std::string carrier = i == 0 ? "" : chain.joints[i - 1].link;
      fix_to(chain.joints[i], before, carrier);
      Body body;
      add(body, *model_.getLink(chain.joints[i].link), Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(),
          i + 1 < names.size() ? names[i + 1] : "");
      chain.links.push_back(parameters_of(body));
    }
    return chain;
  }

  std::vector<std::string> moving() const {
    std::vector<std::string> names;
    std::vector<urdf::JointConstSharedPtr> next;
    add_moving(*model_.getRoot(), next);
    while (!next.empty()) {
      if (next.size() > 1)
        throw BadData(name_,
                      "joints '" + next[0]->name + "' and '" + next[1]->name +
                          "' begin at the same body: only a serial chain is known; which of them "
                          "stands still is to be said (held_joints of a rig file, --hold of plan_motion)");
      names.push_back(next.front()->name);
      const urdf::LinkConstSharedPtr link = model_.getLink(next.front()->child_link_name);
      next.clear();
      add_moving(*link, next);
    }
    if (names.empty()) throw BadData(name_, "has no joint that moves");
    return names;
  }

  JointLimits limits(const std::string& name) const {
    const urdf::Joint& j = known(name);
    JointLimits out{kNaN, kNaN, kNaN, kNaN};
    if (!j.limits) return out;
    if (j.type == urdf::Joint::REVOLUTE && j.limits->lower < j.limits->upper)
      out.lower = j.limits->lower, out.upper = j.limits->upper;
    if (j.limits->velocity > 0) out.velocity = j.limits->velocity;
    if (j.limits->effort > 0) out.effort = j.limits->effort;
    return out;
  }

 private:
  const urdf::Joint& known(const std::string& name) const {
    const auto j = model_.getJoint(name);
    if (!j) throw no_joint(name);
    if (held_.count(name) > 0) throw BadData(name_, "joint '" + name + "' is held and one of the chain");
    if (j->type != urdf::Joint::REVOLUTE && j->type != urdf::Joint::CONTINUOUS)
      throw BadData(name_, "joint '" + name + "' is neither revolute nor continuous: only those are known");
    return *j;
  }

  BadData no_joint(const std::string& name) const {
    std::vector<std::string> there;
    for (const auto& entry : model_.joints_) there.push_back(entry.first);
    return BadData(name_, "no joint '" + printable(name) + "'; there are: " + joined(there));
  }

  void check_held(const std::string& name) const {
    const auto j = model_.getJoint(name);
    if (!j) throw no_joint(name);
    if (j->type != urdf::Joint::REVOLUTE && j->type != urdf::Joint::CONTINUOUS &&
        j->type != urdf::Joint::PRISMATIC)
      throw BadData(
          name_, "joint '" + name + "' is neither revolute, continuous nor prismatic: only those are held");
    unit_axis(*j);
  }

  Eigen::Vector3d unit_axis(const urdf::Joint& j) const {
    const Eigen::Vector3d axis = vector(j.axis);
    if (!(std::fabs(axis.norm() - 1) < kUnitAxis))
      throw BadData(name_, "joint '" + j.name + "': axis is no unit vector");
    return axis;
  }

  bool stands_still(const urdf::Joint& j) const {
    return j.type == urdf::Joint::FIXED || held_.count(j.name) > 0;
  }

  /// Joints that move and begin at the link or at what stands still on it.
  void add_moving(const urdf::Link& link, std::vector<urdf::JointConstSharedPtr>& to) const {
    for (const auto& joint : link.child_joints) {
      if (stands_still(*joint))
        add_moving(*model_.getLink(joint->child_link_name), to);
      else
        to.push_back(joint);
    }
  }

  Place place_of(const urdf::Joint& j) const {
    Place place{matrix(j.parent_to_joint_origin_transform.rotation),
                vector(j.parent_to_joint_origin_transform.position)};
    const auto held = held_.find(j.name);
    if (held == held_.end()) return place;
    if (j.type == urdf::Joint::PRISMATIC)
      place.position += place.rotation * (held->second * vector(j.axis));
    else
      place.rotation = place.rotation * Eigen::AngleAxisd(held->second, vector(j.axis)).toRotationMatrix();
    return place;
  }

  Joint joint(const std::string& name) const {
    const urdf::Joint& j = known(name);
    const Place place = place_of(j);
    return {name, j.child_link_name, place.rotation, place.position, unit_axis(j)};
  }

  /// The joint's frame in that of `carrier` (empty: the base, the frame of the root), from which only joints
  /// that stand still lead to the link `before`.
  void fix_to(Joint& joint, std::string before, const std::string& carrier) const {
    while (before != carrier) {
      const auto link = model_.getLink(before);
      const auto up = link ? link->parent_joint : nullptr;
      if (!up && carrier.empty()) return;
      if (!up || !stands_still(*up))
        throw BadData(name_, "joint '" + joint.name + "' is not the next of one chain after link '" +
                                 (carrier.empty() ? model_.getRoot()->name : carrier) + "'" +
                                 (up ? ": joint '" + up->name + "' is between" : ""));
      const Place place = place_of(*up);
      joint.position = place.rotation * joint.position + place.position;
      joint.rotation = place.rotation * joint.rotation;
      before = up->parent_link_name;
    }
  }

  /// The link and all links fixed to it, at a place in the frame of the body.
  void add(Body& to, const urdf::Link& link, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& position,
           const std::string& next) const {
    if (link.inertial) {
      Body own;
      own.mass = link.inertial->mass;
      own.inertia << link.inertial->ixx, link.inertial->ixy, link.inertial->ixz, link.inertial->ixy,
          link.inertial->iyy, link.inertial->iyz, link.inertial->ixz, link.inertial->iyz, link.inertial->izz;
      own = moved(own, matrix(link.inertial->origin.rotation), vector(link.inertial->origin.position));
      const BodyParameters sum = parameters_of(to) + parameters_of(moved(own, rotation, position));
      if (sum[0] > 0) to = body_of(sum);
    }
    for (const auto& joint : link.child_joints) {
      if (joint->name == next) continue;
      if (!stands_still(*joint))
        throw BadData(name_, "joint '" + joint->name +
                                 "' moves and is not one of the rig's: only a serial chain is known; one "
                                 "that stands still is named in held_joints");
      const Place place = place_of(*joint);
      add(to, *model_.getLink(joint->child_link_name), rotation * place.rotation,
          position + rotation * place.position, next);
    }
  }

  const urdf::ModelInterface& model_;
  const std::string& name_;
  HeldJoints held_;
};

/// xacro has to run first: else macros would be left out without a word.
void refuse_xacro(const std::string& text, const std::string& name) {
  std::size_t at = text.find("<xacro:");
  for (std::size_t comment = 0; at != std::string::npos; at = text.find("<xacro:", comment)) {
    comment = text.find("<!--", comment);
    if (comment > at) break;
    comment = text.find("-->", comment);
    if (comment == std::string::npos) return;
  }
  if (at == std::string::npos) return;
  const std::size_t end = text.find_first_of(" \t\r\n/>", at);
  throw BadData(name, "is a xacro file (element " + printable(text.substr(at + 1, end - at - 1)) +
                          "), no URDF: what its macros make would be left out. Make the URDF first: rosrun "
                          "xacro xacro " +
                          printable(name) + " > robot.urdf");
}

urdf::ModelInterfaceSharedPtr model_of(const std::string& text, const std::string& name) {
  refuse_xacro(text, name);
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text);
  if (!model) throw BadData(name, "cannot be read as a URDF");
  return model;
}

}  // namespace

Chain chain_of_urdf(const std::string& text, const std::string& name, const std::vector<std::string>& joints,
                    const HeldJoints& held) {
  return Reader(*model_of(text, name), name, held).chain(joints);
}

std::string read_urdf(const std::string& path) {
  return read_start(path, kLargestUrdf);
}

Chain read_chain(const std::string& urdf_path, const std::vector<std::string>& joints,
                 const HeldJoints& held) {
  return chain_of_urdf(read_urdf(urdf_path), urdf_path, joints, held);
}

std::vector<std::string> moving_joints(const std::string& urdf_path, const HeldJoints& held) {
  return Reader(*model_of(read_urdf(urdf_path), urdf_path), urdf_path, held).moving();
}

std::vector<JointLimits> read_limits(const std::string& urdf_path, const std::vector<std::string>& joints) {
  const urdf::ModelInterfaceSharedPtr model = model_of(read_urdf(urdf_path), urdf_path);
  std::vector<JointLimits> all;
  for (const std::string& name : joints) all.push_back(Reader(*model, urdf_path, {}).limits(name));
  return all;
}

}  // namespace backlash::arm
