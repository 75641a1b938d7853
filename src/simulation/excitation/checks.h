// SPDX-License-Identifier: BSD-3-Clause
// What every excitation checks.
#pragma once

#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::simulation {

constexpr int kFewestLines = 16, kMostLines = 10'000;  // of random torque

inline void require(const char* name, double value, const Range& range) {
  if (!range.contains(value)) throw InvalidParameter(std::string("excitation.") + name, value, range.text());
}

}  // namespace backlash::simulation
