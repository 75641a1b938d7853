// SPDX-License-Identifier: BSD-3-Clause
// What drives of a drawn arm have that they had not before: effects that the package knows, one or two of
// them, and things that look like one and are none.
#pragma once

#include <string>
#include <vector>

#include "blind_arm.h"

namespace blind_arms {

const std::vector<Kind>& flaws();

/// The arm that the rig file and the training records are of, and as it is afterwards, see flaws().
Arm arm_before(std::uint64_t seed, const std::string& flaw);
Arm arm_with(std::uint64_t seed, const std::string& flaw);

}  // namespace blind_arms
