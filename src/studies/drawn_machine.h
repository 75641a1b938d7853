// SPDX-License-Identifier: BSD-3-Clause
// A machine as its rig file describes it, but for what the file does not know exactly.
#pragma once

#include <cstdint>

#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::studies {

/// The rig with the stiffness of its couplings drawn about the declared values (normal, relative standard
/// deviation diagnosis.stiffness_uncertainty, at most three of them). Deterministic for a seed.
model::Rig draw_machine(const rig_file::RigFile& file, std::uint64_t seed);

}  // namespace backlash::studies
