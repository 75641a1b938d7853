// SPDX-License-Identifier: BSD-3-Clause
// What the JSON, the page and the plots of a diagnosis share.
#pragma once

#include "backlash_diagnosis/report/diagnosis_report.h"
#include "json.h"

namespace backlash::report {

/// The report as a value; keys in the order of the documentation.
Json diagnosis_data(const DiagnosisReport& report);

/// Of its machine fitted to the record; null where there is none.
const diagnosis::WaveformEvidence* waveform_evidence(const diagnosis::Diagnosis& diagnosis);

/// "79.98"; "?" for what is not finite.
std::string four_digits(double value);

}  // namespace backlash::report
