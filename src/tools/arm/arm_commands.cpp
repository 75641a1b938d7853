// SPDX-License-Identifier: BSD-3-Clause
#include "tools/arm/arm_commands.h"

#include <map>

#include "backlash_diagnosis/rig_file/rig_file.h"
#include "tools/common/for_arm.h"

namespace backlash::tools {

extern "C" int backlash_run_for_arm(const Arguments& arguments, RecordDoor& door) {
  static const std::map<std::string, int (*)(const Arguments&, RecordDoor&)> commands = {
      {"simulate", [](const Arguments& a, RecordDoor&) { return simulate_arm(a); }},
      {"check_record", [](const Arguments& a, RecordDoor&) { return check_arm(a); }},
      {"convert_record", [](const Arguments& a, RecordDoor&) { return convert_arm(a); }},
      {"diagnose_record", diagnose_arm},
      {"identify",
       [](const Arguments& a, RecordDoor& door) {
         return rig_file::is_arm_rig(a.text("rig")) ? identify_arm(a, door) : weigh_joint(a, door);
       }},
      {"export_model", [](const Arguments& a, RecordDoor&) { return export_arm(a); }},
      {"trace_residual", trace_arm_residual},
  };
  return commands.at(door.command())(arguments, door);
}

}  // namespace backlash::tools
