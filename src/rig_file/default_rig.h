// SPDX-License-Identifier: BSD-3-Clause
// The text of config/sarkar_1997.yaml, put into the library by CMake.
#pragma once

namespace backlash::rig_file {

extern const char* const kDefaultRig;

}  // namespace backlash::rig_file
