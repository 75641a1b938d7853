// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace backlash {

/// Version of the package, as package.xml states it.
const char* version();

/// "SUNDIALS 6.4.1, Eigen 3.4.0, GCC 12.2.0": what numbers depend on beside it.
std::string built_with();

}  // namespace backlash
