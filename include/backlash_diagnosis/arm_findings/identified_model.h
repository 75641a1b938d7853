// SPDX-License-Identifier: BSD-3-Clause
// The identified machine in the robot's own URDF or MJCF: mass, centre and inertia of the links and the
// friction of the joints are written into the text; all else stays byte by byte.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/geared_arm/geared_arm.h"

namespace backlash::arm_findings {

struct IdentifiedModel {
  std::string text;
  std::vector<std::string> written;  // "wrist_1_link: mass, centre, inertia"
  std::vector<std::string> kept;     // what keeps the file's value, and why
  std::vector<std::string> unsaid;   // what was identified and has no place in such a file
};

/// A link that carries others by fixed joints gets what the identified body leaves of them: these keep their
/// own values. A parameter that no motion showed keeps the file's value. Inertias stand in the axes that the
/// file has. Play has no element: a comment in its joint says it. Throws BadData, naming `source`, where the
/// text is no URDF of this chain: a joint that is not there, or stands elsewhere.
IdentifiedModel identified_urdf(const std::string& text, const std::string& source,
                                const geared_arm::GearedArm& arm);

/// The same of a MuJoCo file. Joints are found by their names; bodies may have frames of their own, as long
/// as the axes at angle 0 lie to each other as those of the rig's robot. A value that a default class gives
/// is written at the joint itself. Inertias become `fullinertia`. Throws BadData with line and remedy also
/// where the file has what would change or hide the values: include, frame, global coordinates, masses of
/// geoms.
IdentifiedModel identified_mjcf(const std::string& text, const std::string& source,
                                const geared_arm::GearedArm& arm);

}  // namespace backlash::arm_findings
