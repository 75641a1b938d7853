// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/for_arm.h"

#include "backlash_diagnosis/base/loaded_function.h"

namespace backlash::tools {

int run_for_arm(const std::string& name, const Arguments& arguments) {
  return loaded_function<decltype(backlash_run_for_arm)>("backlash_diagnosis_arm_tools",
                                                         "backlash_run_for_arm")(name, arguments);
}

}  // namespace backlash::tools
