// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>

#include "tools/arm/arm_commands.h"
#include "tools/arm/arm_record.h"
#include "tools/common/exit_codes.h"
#include "tools/common/record_file.h"

namespace backlash::tools {

int convert_arm(const Arguments& arguments) {
  const std::string &in = arguments.positional(0), &out = arguments.positional(1);
  for (const char* option : {"from", "to", "joint", "topic"})
    if (arguments.has(option))
      throw UsageError(std::string("--") + option + " is of one joint; an arm is converted whole");
  const arm::ArmRig rig = arm::load_arm_rig(arguments.text("rig"));
  const std::vector<record::JointRecord> joints = read_joints(in, rig);
  check_output(out, {in, arguments.text("rig")});
  for (const std::string& warning : joints.front().record.warnings)
    std::cerr << "convert_record: " << in << ": " << warning << '\n';
  write_joints(joints, out);
  std::cout << out << ": " << joints.front().record.size() << " samples of " << joints.size() << " joints\n";
  return kHealthy;
}

}  // namespace backlash::tools
