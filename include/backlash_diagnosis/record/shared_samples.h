// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

/// Share, 0 to 1, of `asked` whose samples of motor_torque and motor_position stand in `known` as well, in
/// the same order and with the same bits, at whatever time: 1 for a copy, a half for a record of which
/// `known` holds one. Estimated from 64 blocks of 32 samples in which something moves; NaN where there are
/// none, or where a record lacks one of the channels.
double shared_samples(const Record& asked, const Record& known);

}  // namespace backlash::record
