// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/version.h"

namespace backlash {

const char* version() {
  return BACKLASH_DIAGNOSIS_VERSION;
}

}  // namespace backlash
