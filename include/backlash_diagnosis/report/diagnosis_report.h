// SPDX-License-Identifier: BSD-3-Clause
// What diagnose_record reports: as JSON for programs and as text for people.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>

#include "backlash_diagnosis/diagnosis/diagnose.h"

namespace backlash::report {

/// A diagnosis and what it rests on.
struct DiagnosisReport {
  const record::Record* record = nullptr;
  std::vector<std::string> warnings;  ///< of the record and of the curve
  std::optional<diagnosis::ApdSettings> apd_settings;
  std::optional<diagnosis::Limits> limits;            ///< that the verdict grades by
  std::string rig;                                    ///< name; empty: none
  std::string rig_digest;                             ///< of the rig file; empty: none
  const diagnosis::MonitoringCurve* curve = nullptr;  ///< may be null
  std::string curve_source;                           ///< path, or "built for this record"
  diagnosis::Diagnosis diagnosis;
};

/// The `diagnose_record` JSON of the design; keys in the order of the documentation, NaN is null.
std::string diagnosis_json(const DiagnosisReport& report);

/// Lengths in m, angles in rad and deg.
void print_summary(const DiagnosisReport& report, std::ostream& out);

}  // namespace backlash::report
