// SPDX-License-Identifier: BSD-3-Clause
// A serial chain of revolute joints with rigid links: geometry and inertias. Joint i turns link i about an
// axis that is fixed in the link before it (link 0: the base, which stands still).
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace backlash::arm {

/// The ten standard parameters of a body in a frame of it, in which its motion is linear:
///   m [kg], m c_x, m c_y, m c_z [kg m], I_xx, I_xy, I_xz, I_yy, I_yz, I_zz [kg m^2] about the frame's
///   origin.
using BodyParameters = Eigen::Matrix<double, 10, 1>;

/// The same as people say it.
struct Body {
  double mass = 0;                                    // kg
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();   // m, of mass
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // kg m^2, about the centre of mass
};

BodyParameters parameters_of(const Body& body);
Body body_of(const BodyParameters& parameters);  // mass != 0

/// P = [Sigma, m c; (m c)^T, m], Sigma = tr(I) / 2 - I: positive definite where and only where a distribution
/// of mass exists that has these parameters (Wensing, Kim and Slotine 2018, IEEE RA-L 3:60).
Eigen::Matrix4d pseudo_inertia(const BodyParameters& parameters);

/// Smallest eigenvalue of P > 0.
bool is_consistent(const BodyParameters& parameters);

struct Joint {
  std::string name;  // of the joint
  std::string link;  // that it turns
  Eigen::Matrix3d rotation =
      Eigen::Matrix3d::Identity();  // turns vectors of this frame, at q = 0, into the frame before
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, of this frame's origin, in the frame before
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     // unit, in this frame
};

struct Chain {
  std::vector<Joint> joints;
  std::vector<BodyParameters> links;           // one per joint, in its frame
  Eigen::Vector3d gravity = {0, 0, -9.80665};  // m/s^2, in the base

  std::size_t size() const { return joints.size(); }
};

/// Body `b` given in a frame at `position` and turned by `rotation`, said in the frame outside.
Body moved(const Body& b, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& position);

/// The text of a URDF. Throws MissingInput.
std::string read_urdf(const std::string& path);

/// Joints of a URDF that stand still, fingers of a gripper for instance, and where [rad; m of a prismatic
/// one]. Joints that mimic one of them stand still with it, unless they are named themselves.
using HeldJoints = std::map<std::string, double>;

/// The chain through the joints of these names in a URDF. Links behind fixed and held joints belong to the
/// link that carries them. Throws MissingInput, BadData where the file is no URDF, a joint is not there, one
/// of the chain is held or not revolute or continuous, a held one is not revolute, continuous or prismatic,
/// the joints are not one chain in this order, or another moving joint branches off from it.
Chain read_chain(const std::string& urdf_path, const std::vector<std::string>& joints,
                 const HeldJoints& held = {});
Chain chain_of_urdf(const std::string& text, const std::string& name, const std::vector<std::string>& joints,
                    const HeldJoints& held = {});

/// All joints that are neither fixed nor held, from the root to the tip. Throws MissingInput; BadData where
/// the file is no URDF, has no such joint, a held one is not there, or where two begin at one link: that is
/// no chain.
std::vector<std::string> moving_joints(const std::string& urdf_path, const HeldJoints& held = {});

/// What the limit element of a joint says; NaN where it does not: a revolute joint without lower < upper, a
/// continuous one (which has no such limits), velocity or effort that are not > 0.
struct JointLimits {
  double lower, upper;  // rad
  double velocity;      // rad/s
  double effort;        // N m
};

/// Of the joints of these names. Throws MissingInput, BadData as read_chain().
std::vector<JointLimits> read_limits(const std::string& urdf_path, const std::vector<std::string>& joints);

}  // namespace backlash::arm
