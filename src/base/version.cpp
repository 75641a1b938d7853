// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/version.h"

#include <Eigen/Core>

namespace backlash {

const char* version() {
  return BACKLASH_DIAGNOSIS_VERSION;
}

std::string built_with() {
  const auto number = [](int version) { return std::to_string(version); };
  return "SUNDIALS " BACKLASH_DIAGNOSIS_SUNDIALS_VERSION ", Eigen " + number(EIGEN_WORLD_VERSION) + "." +
         number(EIGEN_MAJOR_VERSION) + "." + number(EIGEN_MINOR_VERSION) +
#ifdef __clang__
         ", Clang " __clang_version__;
#else
         ", GCC " __VERSION__;
#endif
}

}  // namespace backlash
