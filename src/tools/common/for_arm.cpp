// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/for_arm.h"

#include "backlash_diagnosis/base/loaded_function.h"

namespace backlash::tools {

int run_for_arm(const Arguments& arguments, RecordDoor& door) {
  return loaded_function<decltype(backlash_run_for_arm)>("backlash_diagnosis_arm_tools",
                                                         "backlash_run_for_arm")(arguments, door);
}

}  // namespace backlash::tools
