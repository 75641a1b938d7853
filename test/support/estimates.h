// SPDX-License-Identifier: BSD-3-Clause
// Finding the estimate of a method among those of a diagnosis.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/estimate.h"

namespace backlash::test {

inline const diagnosis::Estimate& by(const std::string& method,
                                     const std::vector<diagnosis::Estimate>& estimates) {
  for (const diagnosis::Estimate& estimate : estimates)
    if (estimate.method == method) return estimate;
  throw std::runtime_error("no estimate by " + method);
}

}  // namespace backlash::test
