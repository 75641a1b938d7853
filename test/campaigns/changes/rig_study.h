// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace backlash::change_study {

struct RigStudy {
  std::string rig;           // file
  int changes = 0;           // records that change once
  double healthy_hours = 0;  // of records that do not
  double rate = 1.0 / 720;   // 1/h, false alarms that are allowed
  bool position = true;      // of the motor is in the records
  std::string only;          // change by its name; empty: all
  unsigned long seed = 1;
  double duration = 150;  // s, of a record
};

/// Prints how often changes of drawn torque-sensor rigs are found, named, and whether their intervals hold.
void study_rigs(const RigStudy& study);

}  // namespace backlash::change_study
