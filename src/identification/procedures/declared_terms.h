// SPDX-License-Identifier: BSD-3-Clause
// What the terms that a rig file declares take of the torque of a machine of one inertia.
#pragma once

#include <vector>

#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::identification {

/// N m, per sample: the torque that the machine needs for the recorded motion with its terms less what it
/// needs without them. Both at the load side, the record evenly sampled with motor_torque and motor_position.
/// Empty of a rig without terms.
std::vector<double> torque_of_terms(const record::Record& record, const model::Rig& rig);

}  // namespace backlash::identification
