// SPDX-License-Identifier: BSD-3-Clause
// What a command does with the rig file of an arm. It is in a library of its own, tools/arm, which is loaded
// then.
#pragma once

#include "tools/common/command_line.h"
#include "tools/common/record_door.h"

namespace backlash::tools {

/// Runs for an arm the command whose door this is, and returns its exit code. Throws MissingInput where that
/// library is not built, and what the command throws.
int run_for_arm(const Arguments& arguments, RecordDoor& door);

/// The library's function behind it.
extern "C" int backlash_run_for_arm(const Arguments& arguments, RecordDoor& door);

}  // namespace backlash::tools
