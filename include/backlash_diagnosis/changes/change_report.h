// SPDX-License-Identifier: BSD-3-Clause
// What has changed of a machine and since when, in words and as JSON.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/changes/changes.h"

namespace backlash::changes {

/// What was asked: paths as the user gave them.
struct ChangeInputs {
  std::string rig, joint;
  std::vector<std::string> healthy;
  std::string record;
  double false_alarms_per_hour = 0;
};

/// One line per change; or that none was found.
std::string change_summary(const Changes& changes);

/// The detect_changes JSON of the design, and beyond it inputs, threshold, noise, warnings and of each change
/// gain, errors before and after, and what fits alike.
std::string change_json(const Changes& changes, const ChangeInputs& inputs);

}  // namespace backlash::changes
