// SPDX-License-Identifier: BSD-3-Clause
#include "tools/arm/arm_commands.h"

#include <map>

#include "tools/common/for_arm.h"

namespace backlash::tools {

extern "C" int backlash_run_for_arm(const std::string& name, const Arguments& arguments) {
  static const std::map<std::string, int (*)(const Arguments&)> commands = {
      {"simulate", simulate_arm},
      {"diagnose_record", diagnose_arm},
      {"identify", identify_arm},
      {"trace_residual", trace_arm_residual},
  };
  return commands.at(name)(arguments);
}

}  // namespace backlash::tools
