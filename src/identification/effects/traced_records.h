// SPDX-License-Identifier: BSD-3-Clause
// Records that a trace can use, and what it warns of.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/fit/servo_data.h"

namespace backlash::identification {

/// Throws CannotIdentify for a record without load position, which a rig with two inertias needs, with a load
/// that does not move, or with a motor so slow that its speed is below the noise of its encoder; also throws
/// as servo_data(). `interval` [s]: that of all records, which those of a higher rate are brought to; 0: the
/// record's own.
ServoData traced_data(const record::Record& record, const model::Rig& rig, double usual_torque = 0,
                      double interval = 0);

/// s: between the samples of the slowest record.
double common_interval(const std::vector<record::Record>& train, const record::Record& test);

/// Warnings if the test record goes beyond the travel, speed or torque of the training records.
std::vector<std::string> range_warnings(const std::vector<ServoData>& train, const ServoData& test,
                                        bool linear);

}  // namespace backlash::identification
