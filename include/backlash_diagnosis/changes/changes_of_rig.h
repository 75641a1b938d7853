// SPDX-License-Identifier: BSD-3-Clause
// Since when a machine with a torque sensor before the gear is another one, and by which value. Stretches of
// some reversals are fitted as a whole (diagnosis/waveform.h), which gives score and information of each
// value of the machine: backlash, stiffnesses, friction, inertias, contact, sensor. Generalised likelihood
// ratio over value, onset and shape (a step, or growth to the end) of the scores of all stretches; then more
// stretches about the onset, by halves.
//
// Values of the healthy machine are nuisances with a spread from record to record. A change is reported by
// the name of a value where that value alone explains what all values together would; else it is unknown.
#pragma once

#include <vector>

#include "backlash_diagnosis/changes/changes.h"
#include "backlash_diagnosis/diagnosis/waveform.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::changes {

/// Throws CannotIdentify where the healthy records do not fit the machine or the record shows too little,
/// InvalidParameter for settings out of range, Cancelled.
Changes changes_of_rig(const diagnosis::WaveformSettings& machine, const std::vector<record::Record>& healthy,
                       const record::Record& record, const ChangeSettings& settings = {},
                       const Progress& progress = {});

/// Of any machine whose changes can be found. Throws as changes_of_rig and the other detect_changes.
Changes detect_changes(const rig_file::RigFile& file, const std::vector<record::Record>& healthy,
                       const record::Record& record, const ChangeSettings& settings = {},
                       const Progress& progress = {});

}  // namespace backlash::changes
