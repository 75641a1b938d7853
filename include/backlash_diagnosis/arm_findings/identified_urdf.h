// SPDX-License-Identifier: BSD-3-Clause
// The identified machine in the robot's own URDF: mass, centre and inertia of the links, friction of the
// joints and their play are written into the text; all else stays byte by byte.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/geared_arm/geared_arm.h"

namespace backlash::arm_findings {

struct IdentifiedUrdf {
  std::string text;
  std::vector<std::string> written;  // "wrist_1_link: mass, centre, inertia"
  std::vector<std::string> kept;     // what keeps the file's value, and why
  std::vector<std::string> unsaid;   // what was identified and has no place in a URDF
};

/// A link that carries others by fixed joints gets what the identified body leaves of them: these keep their
/// own values. A parameter that no motion showed keeps the file's value. Inertias stand in the axes that the
/// file has. Play has no element: a comment in its joint says it. Throws BadData, naming `source`, where the
/// text is no URDF of this chain: a joint that is not there, or stands elsewhere.
IdentifiedUrdf identified_urdf(const std::string& text, const std::string& source,
                               const geared_arm::GearedArm& arm);

}  // namespace backlash::arm_findings
