// SPDX-License-Identifier: BSD-3-Clause
// The rig file with what the search for missing effects has found: fitted machine, and one entry of `terms:`
// per effect.
#pragma once

#include <string>

#include "backlash_diagnosis/identification/effects/effect_search.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::identification {

/// Fitted values are in the units of the file (of the motor shaft where it says motor_side: true), each with
/// its standard error as comment; terms are always at the load side. Layout, other values, declared terms and
/// comments stay. Throws BadData where a value that has to change is not where it can be.
std::string traced_rig_text(const rig_file::RigFile& declared, const Trace& trace);

/// Throws what traced_rig_text() would, before the long work.
void check_traced_rig_text(const rig_file::RigFile& declared);

}  // namespace backlash::identification
