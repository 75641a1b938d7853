// SPDX-License-Identifier: BSD-3-Clause
// What the JSON, the page and the plots of a diagnosis share.
#pragma once

#include "backlash_diagnosis/report/diagnosis_report.h"
#include "json.h"

namespace backlash::report {

/// The report as a value; keys in the order of the documentation.
Json diagnosis_data(const DiagnosisReport& report);

/// "79.98"; "?" for what is not finite.
std::string four_digits(double value);

}  // namespace backlash::report
