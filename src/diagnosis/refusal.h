// SPDX-License-Identifier: BSD-3-Clause
// How estimators give up: a status with its reason, thrown where the record turns out unfit.
#pragma once

#include <string>

#include "backlash_diagnosis/diagnosis/estimate.h"

namespace backlash::diagnosis {

struct Refusal {
  Status status;
  std::string reason;
};

/// The estimate that `fill` makes, or the status and reason with which it gives up.
template <typename Fill>
Estimate estimate_or_refusal(const char* method, Fill fill) {
  Estimate estimate;
  estimate.method = method;
  try {
    fill(estimate);
  } catch (const Refusal& refusal) {
    estimate.status = refusal.status;
    estimate.message = refusal.reason;
  }
  return estimate;
}

}  // namespace backlash::diagnosis
