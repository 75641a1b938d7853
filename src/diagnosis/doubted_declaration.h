// SPDX-License-Identifier: BSD-3-Clause
// How far declared values count once the record shows that the machine is not of the declared kind.
#pragma once

#include <vector>

#include "backlash_diagnosis/diagnosis/estimate.h"

namespace backlash::diagnosis {

/// Where `waveform` was fitted and no machine of the rig file's kind explains the record, what the answers
/// owe to declared values (Estimate::declared) counts twice in their intervals.
void doubt_declared_values(std::vector<Estimate>& estimates);

}  // namespace backlash::diagnosis
