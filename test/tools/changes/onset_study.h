// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "made_joint.h"

namespace backlash::change_study {

/// Joints that change once, `count` in turn of each effect in three sizes: prints a table of how many are
/// found and named, and how many intervals hold the truth.
void study_onsets(int count, unsigned long seed, const MadeOptions& made, double rate_of_look);

}  // namespace backlash::change_study
