// SPDX-License-Identifier: BSD-3-Clause
// How declared values enter the intervals if the record shows that the machine is not of the declared kind.
#pragma once

#include <vector>

#include "backlash_diagnosis/diagnosis/estimate.h"

namespace backlash::diagnosis {

/// If `waveform` was fitted and no machine of the rig file's kind explains the record, the part of each
/// interval that comes from declared values (Estimate::declared) is doubled.
void doubt_declared_values(std::vector<Estimate>& estimates);

}  // namespace backlash::diagnosis
