// SPDX-License-Identifier: BSD-3-Clause
// A diagnosis kept as the baseline of the healthy machine.
#pragma once

#include <string>

#include "backlash_diagnosis/diagnosis/diagnose.h"

namespace backlash {

/// What the verdict stands on, as a baseline of the rig with this name and digest. Throws BadData, naming the
/// rig and the reason, where the verdict is no value with an interval or its estimates contradict each other.
Baseline baseline_of(const Diagnosis& diagnosis, const std::string& rig, const std::string& rig_digest);

}  // namespace backlash
