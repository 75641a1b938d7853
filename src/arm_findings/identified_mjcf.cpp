// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "identified_writer.h"
#include "mjcf_robot.h"

namespace backlash::arm_findings {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kRounded =
    1e-3;  // m, rad; choice: MuJoCo's models of robots have lengths in whole millimetres
constexpr double kExact = 1e-6;         // m, rad; choice: rounding of a printed file, not worth a word
constexpr double kUndetermined = 1e-9;  // weight of "the same frame" beside what the axes show; choice

/// The axes of a chain as lines, in the frame of its first link, all joints at 0.
struct Lines {
  std::vector<Vector3d> directions, points;

  /// Directions that a turn of the chain turns: the axes, and from one to the next where they are parallel.
  std::vector<Vector3d> vectors() const {
    std::vector<Vector3d> all = directions;
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Vector3d between = points[i] - points[i - 1], &along = directions[i];
      const bool parallel = along.cross(directions[i - 1]).norm() < kRounded;
      all.emplace_back(parallel ? Vector3d(between - along.dot(between) * along) : Vector3d::Zero());
    }
    return all;
  }
};

/// The frame in which `a` lies as `b` does, by least squares; what the axes leave free, as along parallel
/// ones, is as if both frames were one.
Isometry3d frame_of(const Lines& a, const Lines& b) {
  Eigen::Matrix3d sum = kUndetermined * Eigen::Matrix3d::Identity();
  const std::vector<Vector3d> va = a.vectors(), vb = b.vectors();
  for (std::size_t i = 0; i < va.size(); ++i) sum += vb[i] * va[i].transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  Isometry3d out = Isometry3d::Identity();
  out.linear() = svd.matrixU() * Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  Eigen::Matrix3d normal = kUndetermined * Eigen::Matrix3d::Identity();
  Vector3d right = Vector3d::Zero();
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - b.directions[i] * b.directions[i].transpose();
    normal += across;
    right += across * (b.points[i] - out.linear() * a.points[i]);
  }
  out.translation() = normal.ldlt().solve(right);
  return out;
}

class MjcfWriter : public IdentifiedWriter {
 public:
  MjcfWriter(const std::string& text, const std::string& source, const geared_arm::GearedArm& arm)
      : IdentifiedWriter(text, source, arm), robot_(*root_, source) {}

 private:
  struct Joint {
    std::size_t body = 0;
    const XmlElement* element = nullptr;
  };

  Joint find(const std::string& name) const {
    std::vector<std::string> there;
    for (std::size_t b = 0; b < robot_.bodies().size(); ++b)
      for (const XmlElement* joint : robot_.bodies()[b].joints) {
        there.push_back(printable(joint->attribute("name")));
        if (joint->attribute("name") != name) continue;
        const MjcfBody& body = robot_.bodies()[b];
        const std::string type = robot_.value(*joint, body, "type");
        if (joint->name != "joint" || (!type.empty() && type != "hinge"))
          robot_.refuse(*joint, "joint '" + name + "' is no hinge: only those are known");
        if (body.joints.size() > 1)
          robot_.refuse(*body.element, "has several joints: give joint '" + name + "' a body of its own");
        return {b, joint};
      }
    throw BadData(source_, "no joint '" + printable(name) + "' as the rig file has it; there are: " +
                               joined(there) + "; call them alike in both files");
  }

  /// Where a body that stands still on another does so; held joints where the rig file holds them.
  Isometry3d still(const MjcfBody& body) const {
    if (body.joints.empty()) return body.place;
    const std::string name = body.joints[0]->attribute("name");
    const auto held = rig_.held.find(name);
    if (body.joints.size() > 1 || held == rig_.held.end())
      robot_.refuse(*body.joints[0], "joint '" + printable(name) +
                                         "' moves and is not one of the rig's: only a serial chain is known; "
                                         "one that stands still is named in held_joints of the rig file");
    return robot_.place(body, *body.joints[0], held->second);
  }

  /// The frame of joint i in that of the joint before, all at 0.
  Isometry3d step(std::size_t i) const {
    const MjcfBody* body = &robot_.bodies()[joints_[i].body];
    Isometry3d out = robot_.place(*body, *joints_[i].element, 0);
    while (body->parent && *body->parent != joints_[i - 1].body) {
      body = &robot_.bodies()[*body->parent];
      out = still(*body) * out;
    }
    if (!body->parent)
      robot_.refuse(*joints_[i].element, "joint '" + rig_.joints[i].name + "' is not carried by joint '" +
                                             rig_.joints[i - 1].name + "' as in the rig file");
    return out;
  }

  void read_chain() override {
    for (const std::string& name : rig_.joint_names()) joints_.push_back(find(name));
    Lines ours, theirs;
    Isometry3d our = Isometry3d::Identity(), their = Isometry3d::Identity();
    std::vector<Isometry3d> our_frames, their_frames;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const arm::Joint& joint = rig_.chain.joints[i];
      if (i > 0) our = our * Eigen::Translation3d(joint.position) * Eigen::Quaterniond(joint.rotation);
      if (i > 0) their = their * step(i);
      const MjcfBody& body = robot_.bodies()[joints_[i].body];
      ours.directions.emplace_back(our.linear() * joint.axis);
      ours.points.emplace_back(our.translation());
      theirs.directions.emplace_back(their.linear() * robot_.axis(body, *joints_[i].element));
      theirs.points.emplace_back(their * robot_.anchor(body, *joints_[i].element));
      our_frames.push_back(our);
      their_frames.push_back(their);
    }
    const Isometry3d first = frame_of(ours, theirs);
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      frames_.push_back(their_frames[i].inverse() * first * our_frames[i]);
      require_same_place(i, first * ours.points[i] - theirs.points[i], first.linear() * ours.directions[i],
                         theirs.directions[i]);
    }
    note_another_stand(first.linear());
  }

  /// Gravity in the first link at angle 0, of the rig and of the file: links are what they are, torques not.
  void note_another_stand(const Eigen::Matrix3d& first) {
    const MjcfBody* body = &robot_.bodies()[joints_[0].body];
    Eigen::Matrix3d stand = robot_.place(*body, *joints_[0].element, 0).linear();
    for (; body->parent; stand = robot_.bodies()[*body->parent].place.linear() * stand)
      body = &robot_.bodies()[*body->parent];
    Vector3d down(0, 0, -1);
    if (const XmlElement* option = root_->child("option")) {
      const std::vector<double> g = robot_.values(*option, {}, "gravity", {0, 0, -1});
      down = {g[0], g[1], g[2]};
    }
    const Vector3d ours = first * rig_.chain.joints[0].rotation.transpose() * rig_.chain.gravity;
    const double angle =
        std::atan2(ours.cross(stand.transpose() * down).norm(), ours.dot(stand.transpose() * down));
    if (angle > kRounded)
      out_.kept.push_back(
          fmt::format("{}: gravity at angle 0, turned by {:.3g} rad against that of the rig file: the "
                      "robot stands otherwise, or this joint has another zero",
                      rig_.joints[0].name, angle));
  }

  void require_same_place(std::size_t i, const Vector3d& off, const Vector3d& ours, const Vector3d& theirs) {
    const double distance = (off - off.dot(theirs) * theirs).norm(), angle = (ours - theirs).norm();
    const std::string where =
        fmt::format("{:.3g} mm and {:.3g} rad from where that of {} lies to the others at angle 0",
                    1e3 * distance, angle, rig_.urdf);
    if (distance > kRounded || angle > kRounded)
      robot_.refuse(
          *joints_[i].element,
          "the axis of joint '" + rig_.joints[i].name + "' lies " + where +
              ": another robot, another zero (ref) or the other way round; take the file of this robot");
    if (distance > kExact || angle > kExact)
      out_.kept.push_back(rig_.joints[i].name + ": its axis, which lies " + where);
  }

  arm::BodyParameters carried(std::size_t carrier) const {
    arm::BodyParameters sum = arm::BodyParameters::Zero();
    for (std::size_t b = 0; b < robot_.bodies().size(); ++b) {
      const MjcfBody& body = robot_.bodies()[b];
      if (body.parent != carrier ||
          std::any_of(joints_.begin(), joints_.end(), [&](const Joint& joint) { return joint.body == b; }))
        continue;
      const Isometry3d place = still(body);
      const arm::BodyParameters all = arm::parameters_of(robot_.own(body)) + carried(b);
      if (all[0] > 0)
        sum += arm::parameters_of(arm::moved(arm::body_of(all), place.linear(), place.translation()));
    }
    return sum;
  }

  FileLink link(std::size_t i) const override {
    const MjcfBody& body = robot_.bodies()[joints_[i].body];
    FileLink out;
    out.name = body.name;
    out.element = body.element;
    out.inertial = body.inertial;
    if (body.inertial != nullptr) out.own = robot_.own(body);
    out.carried = carried(joints_[i].body);
    out.rig_frame = frames_[i];
    return out;
  }

  void write_body(const FileLink& link, const arm::Body& now, BodyChange change) override {
    const Eigen::Matrix3d& i = now.inertia;
    Attributes values;
    if (change.centre) values.emplace_back("pos", numbers(now.centre));
    if (change.mass) values.emplace_back("mass", number(now.mass));
    if (change.inertia)
      values.emplace_back("fullinertia", numbers(i.diagonal()) + " " + numbers({i(0, 1), i(0, 2), i(1, 2)}));
    if (link.inertial == nullptr)
      changes_.add_first(*link.element, {tag("inertial", values)});
    else if (change.inertia)  // MuJoCo takes fullinertia in the body's axes only
      changes_.set_attributes(*link.inertial, values,
                              {"diaginertia", "quat", "axisangle", "xyaxes", "zaxis", "euler"});
    else
      changes_.set_attributes(*link.inertial, values);
  }

  const char* attribute_of(arm::DriveTerm term) const override {
    if (term == arm::DriveTerm::viscous) return "damping";
    if (term == arm::DriveTerm::coulomb) return "frictionloss";
    return term == arm::DriveTerm::rotor_inertia ? "armature" : nullptr;
  }

  double file_value(std::size_t j, const std::string& attribute) const {
    return robot_.values(*joints_[j].element, robot_.bodies()[joints_[j].body], attribute, {0})[0];
  }

  bool write_drive(std::size_t j, const Attributes& values) override {
    Attributes other;
    for (const auto& [name, value] : values)
      if (parse_number(value).value != file_value(j, name)) other.emplace_back(name, value);
    if (!other.empty()) changes_.set_attributes(*joints_[j].element, other);
    return !other.empty();
  }

  void write_play(std::size_t j, double play) override {
    out_.unsaid.push_back(
        rig_.joints[j].name + ": play " + number(play) +
        " rad: a joint of MJCF has none; it takes a body of the motor's own and a tendon with "
        "limits, as export_model RIG.yaml --out JOINT.xml writes them for one joint");
  }

  void finish_joint(std::size_t j) override {
    for (const arm::DriveTerm term :
         {arm::DriveTerm::viscous, arm::DriveTerm::coulomb, arm::DriveTerm::rotor_inertia})
      if (std::find(rig_.terms.begin(), rig_.terms.end(), term) == rig_.terms.end())
        if (const double value = file_value(j, attribute_of(term)); value != 0)
          out_.kept.push_back(fmt::format(
              "{}: {} {:.4g}: the rig file has no {}, so the torques without it were "
              "fitted",
              rig_.joints[j].name, attribute_of(term), value, arm::kDriveTermSpecs[std::size_t(term)].name));
  }

  MjcfRobot robot_;
  std::vector<Joint> joints_;
  std::vector<Isometry3d> frames_;  // of the rig's links in the file's bodies
};

}  // namespace

IdentifiedModel identified_mjcf(const std::string& text, const std::string& source,
                                const geared_arm::GearedArm& arm) {
  return MjcfWriter(text, source, arm).write();
}

}  // namespace backlash::arm_findings
