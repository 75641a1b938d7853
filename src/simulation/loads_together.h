// SPDX-License-Identifier: BSD-3-Clause
// Loads that follow one record side by side in vector registers.
#pragma once

#include <vector>

#include "free_load.h"

namespace backlash::simulation {

/// As each alone, number by number. At most loads_at_once(), all of which join the first (FreeLoad::joins()).
void follow_all(std::vector<FreeLoad>& loads, const RecordedMotion& motion, std::vector<DrivenLoad>& out);

}  // namespace backlash::simulation
