// SPDX-License-Identifier: BSD-3-Clause
// A rig file to begin with, from what a record and a URDF show. Beside each value stands where it came from
// and how well it is known; what only a person can know has a value to begin with and the words FILL IN.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/arm_rig.h"
#include "backlash_diagnosis/record/channel_map.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/rig_draft/seen_joint.h"

namespace backlash::rig_draft {

/// What a person said of the joint.
struct Given {
  std::optional<double> reduction_ratio;  // motor turns per turn of the joint, > 0
  std::optional<double> rotor_inertia;    // kg m^2, of the motor's own shaft, > 0; needs the ratio
  std::optional<double> stiffness;        // N m/rad, of gear and teeth, at the joint, > 0
};

/// The chain behind a joint, by its URDF.
struct UrdfLoad {
  std::string file;
  double inertia = 0;  // kg m^2, about the joint, the other joints in the pose
  Wave gravity;        // N m: what holds the chain in that pose is amplitude sin(q + phase)
  std::string pose;    // of the other joints, for people
  arm::JointLimits limits{};
};

/// The chain behind joint `joint` with the joints at `pose` [rad].
UrdfLoad load_of_chain(const arm::Chain& chain, std::size_t joint, const std::vector<double>& pose);

struct JointPlace {
  std::string joint;            // what it is called in answers
  std::string record;           // path, for the words in the file
  record::ChannelMap channels;  // of a bag with names of its own; else nothing is written
  bool scalable = false;        // by `channels`; a CSV in the package's own format is not
};

struct Draft {
  std::string text;                  // of the rig file
  std::vector<std::string> to_fill;  // "gear_train.reduction_ratio: on the motor's plate"
  std::vector<std::string> notes;    // what was found, for people
  bool has_play = false;             // the file has teeth: a diagnosis can say their play
};

/// Of a joint by itself. Throws CannotIdentify where neither record nor URDF shows an inertia.
Draft draft_joint(const SeenJoint& seen, const JointPlace& place, const std::optional<UrdfLoad>& urdf,
                  const Given& given);

/// Of an arm; `records` are those of its joints, or empty where there are none.
Draft draft_arm(const arm::ArmRig& urdf, const std::vector<record::JointRecord>& records,
                const std::string& record_path);

/// A text in a line of YAML.
std::string quoted(const std::string& text);

}  // namespace backlash::rig_draft
