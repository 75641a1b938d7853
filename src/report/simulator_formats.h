// SPDX-License-Identifier: BSD-3-Clause
// A joint as XML of each simulator; the axis is y, and z points up. Each adds to JointModel::unsaid what its
// language has no word for.
#pragma once

#include <cmath>
#include <string>

#include "joint_model.h"

namespace backlash::report {

constexpr double kGravity = 9.81;  // m/s^2, stated in each file: what the mass of a load is reckoned by

std::string xml_text(const std::string& text);
std::string xml_comment(const std::string& text);

/// Comments that stand at the top: where it is from, and what is not said.
std::string about(const rig_file::RigFile& file, const JointModel& joint, const std::string& indent);

/// A body whose inertia about the axis of the joint, and whose weight, are those of the joint's.
struct JointInertia {
  double mass;     // kg
  double inertia;  // kg m^2, about its centre, the same about each axis
  double x, z;     // m, of its centre from the axis
};
JointInertia inertia_of(const JointModel& joint, bool last);

std::string mjcf(const rig_file::RigFile& file, JointModel& joint);
std::string urdf(const rig_file::RigFile& file, JointModel& joint);
std::string sdf(const rig_file::RigFile& file, JointModel& joint);

}  // namespace backlash::report
