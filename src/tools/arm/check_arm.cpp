// SPDX-License-Identifier: BSD-3-Clause
#include "tools/arm/arm_commands.h"
#include "tools/arm/arm_record.h"
#include "tools/common/serves.h"

namespace backlash::tools {

int check_arm(const Arguments& arguments) {
  const arm::ArmRig rig = arm::load_arm_rig(arguments.text("rig"));
  const std::string& path = arguments.positional(0);
  return report_of(look_at_joints(read_joints(path, rig), path, rig.channel, arguments.has("plot")),
                   arguments);
}

}  // namespace backlash::tools
