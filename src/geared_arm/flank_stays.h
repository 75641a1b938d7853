// SPDX-License-Identifier: BSD-3-Clause
// When the load of a mesh shows for certain on which flank its teeth rest. One rule for the diagnosis and for
// the motion that is planned for it.
#pragma once

#include <cstddef>
#include <vector>

#include "backlash_diagnosis/geared_arm/play.h"

namespace backlash::geared_arm {

constexpr double kRowsPerCycle = 5;  // of torque_cutoff: those of arm::ArmMotion, or more

/// Rows that a low-pass smears a change of flank over.
std::size_t guard_rows(const PlaySettings& settings);

/// |T| [N m] beyond which the flank is certain; `most`: the largest |T|.
double certain_load(const JointLoad& load, double most, const PlaySettings& settings);

/// Per row 1, -1, or 0 where the flank is not certain: the load small, or small within `guard` rows. A
/// stretch begins where `first` is true.
std::vector<int> sides_of(const std::vector<double>& torque, const std::vector<bool>& first, double least,
                          std::size_t guard);

/// Number of the stay per row that counts; `count` on the negative and the positive flank.
std::vector<std::size_t> stays_of(const std::vector<int>& sides, std::size_t count[2]);

}  // namespace backlash::geared_arm
