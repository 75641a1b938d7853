// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/held_joints.h"

#include "backlash_diagnosis/base/text.h"

namespace backlash::tools {

Option hold_option() {
  return {
      "hold", "JOINT[=POSITION]...",
      "of a URDF: joints that stand still, a gripper's for instance, and where [rad; m of a prismatic one]; "
      "without a position at 0"};
}

std::map<std::string, double> held_joints(const Arguments& arguments) {
  std::map<std::string, double> held;
  if (!arguments.has("hold")) return held;
  for (const std::string& text : arguments.texts("hold")) {
    const auto sign = text.find('=');
    double position = 0;
    if (sign != std::string::npos) {
      const ParsedNumber number = parse_number(std::string_view(text).substr(sign + 1));
      if (!number) throw UsageError("--hold '" + printable(text) + "': the position is " + number.problem);
      position = number.value;
    }
    if (!held.emplace(text.substr(0, sign), position).second)
      throw UsageError("--hold names '" + printable(text.substr(0, sign)) + "' twice");
  }
  return held;
}

}  // namespace backlash::tools
