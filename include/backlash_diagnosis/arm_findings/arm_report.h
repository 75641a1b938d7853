// SPDX-License-Identifier: BSD-3-Clause
// What was found of an arm, as JSON, as text and as a rig file. All at the joints' side of the reductions.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/fit_records.h"
#include "backlash_diagnosis/arm/trace.h"
#include "backlash_diagnosis/findings/trace_report.h"

namespace backlash::arm_findings {

using Carried = std::vector<std::optional<arm::Carried>>;  // of each record; empty: none carries anything

/// The `identify` JSON of the design. Parameters: JOINT/term, JOINT/torque_constant, JOINT/delay,
/// LINK/parameter of the base parameters. Channels: JOINT/torque. What was carried is in `payloads`, what the
/// motions do not show of the links in `not_identifiable`, where the scale comes from in `common_scale`.
std::string arm_identification_json(const arm::ArmFit& fit, const std::string& rig,
                                    const std::vector<std::string>& records, const Carried& carried = {});
void print_arm_summary(const arm::ArmFit& fit, const std::vector<std::string>& records,
                       const Carried& carried, std::ostream& out);

/// The fitted rig as a file.
std::string fitted_arm_text(const arm::ArmFit& fit, const std::vector<std::string>& records);

/// The `trace_residual` JSON of the design, and its series for plots.
std::string arm_trace_json(const arm::ArmTrace& trace, const findings::TraceInputs& inputs);
std::string arm_series_json(const arm::ArmTrace& trace);
std::string arm_verdict_sentence(const arm::ArmTrace& trace);
void print_arm_trace(const arm::ArmTrace& trace, std::ostream& out);

/// The page; `plots` is what the script drew, or a sentence on why there is nothing; `provenance` ends it.
std::string arm_trace_page(const arm::ArmTrace& trace, const findings::TraceInputs& inputs,
                           const std::string& plots, const std::string& provenance);

}  // namespace backlash::arm_findings
