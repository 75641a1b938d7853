// SPDX-License-Identifier: BSD-3-Clause
// What a rig declares that a record is held against before it is used.
#pragma once

#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/record/declared_motion.h"

namespace backlash::rig_file {

record::DeclaredMotion declared_motion(const model::Rig& rig);

}  // namespace backlash::rig_file
