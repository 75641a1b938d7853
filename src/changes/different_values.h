// SPDX-License-Identifier: BSD-3-Clause
// A record that is another machine's from its first sample on: no onset shows it, the values themselves do.
#pragma once

#include <string>
#include <vector>

#include "change_scan.h"

namespace backlash::changes {

struct DifferentValue {
  std::string name;  // of the parameter, as an effect is named
  std::string text;  // "motor_coulomb by 63 N m (healthy: 62)"
};

/// The values of the record, by a background that holds the changes within it, against those of the healthy
/// machine: what differs by more than healthy records do, its errors and a quarter. Its first `own` columns
/// are of the machine itself. A torque of which all parts differ by one factor is another gain of the torque.
std::vector<DifferentValue> different_values(const HealthyModel& model, const Background& background,
                                             Eigen::Index own, bool linear);

}  // namespace backlash::changes
