// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "made_joint.h"

namespace backlash::change_study {

struct OnsetOptions {
  int count = 0;
  bool look_alikes = false;  // of local faults
  std::string only;          // kind of change; empty: all
  double rate_of_look = 0;   // 1/h, of false alarms
};

/// Joints that change once, `count` in turn of each effect in three sizes: prints a table of how many are
/// found and named, and how many intervals hold the truth.
void study_onsets(const OnsetOptions& options, unsigned long seed, const MadeOptions& made);

}  // namespace backlash::change_study
