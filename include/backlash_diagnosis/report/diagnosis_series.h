// SPDX-License-Identifier: BSD-3-Clause
// What the plots of a diagnosis show, as JSON for the script that draws them.
#pragma once

#include <string>

#include "backlash_diagnosis/report/diagnosis_report.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::report {

/// The report itself, the last periods of the record, the curve, the limits and the waveform of the machine
/// fitted to the record. `rig` may be null.
std::string diagnosis_series(const DiagnosisReport& report, const rig_file::RigFile* rig);

}  // namespace backlash::report
