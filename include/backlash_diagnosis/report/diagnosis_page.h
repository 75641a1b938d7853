// SPDX-License-Identifier: BSD-3-Clause
// A diagnosis as a page for people: verdict, estimates, plots, and how it came about.
#pragma once

#include <string>

#include "backlash_diagnosis/report/diagnosis_report.h"
#include "backlash_diagnosis/report/report_page.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::report {

/// The page of a diagnosis; `rig` may be null. Plots are drawn by a Python script; where that fails the page
/// says so instead.
std::string diagnosis_page(const DiagnosisReport& report, const rig_file::RigFile* rig,
                           const Provenance& provenance);

}  // namespace backlash::report
