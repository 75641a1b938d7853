// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace backlash {

/// Version of the package, as package.xml states it.
const char* version();

}  // namespace backlash
