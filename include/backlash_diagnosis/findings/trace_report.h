// SPDX-License-Identifier: BSD-3-Clause
// What the search for missing effects has found, in words and as JSON. Values are those of the load side of
// the reduction; units are those of a linear axis where the rig is one.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/identification/effects/effect_search.h"
#include "backlash_diagnosis/rig_file/drive.h"

namespace backlash::findings {

/// What was traced: paths as the user gave them.
struct TraceInputs {
  std::string rig;
  std::vector<std::string> train;
  std::string test;
};

/// "effect_found", "nothing_missing", "unexplained"
std::string to_string(identification::TraceVerdict verdict);

/// The verdict in one or two sentences.
std::string verdict_sentence(const identification::Trace& trace);

/// Tables for a terminal: errors before and after, effects, what is left, warnings.
std::string trace_summary(const identification::Trace& trace);

/// The trace_residual JSON of the design: schema_version, verdict, channels, steps, unexplained; and beyond
/// that message, inputs, cutoff, parameters of the machine, words and terms of each effect, warnings. What is
/// not known is null.
std::string trace_report_json(const identification::Trace& trace, const TraceInputs& inputs);

/// For plots: the test record as both models have it and what each step adds to it. As many samples as
/// signals of this bandwidth need.
std::string trace_series_json(const identification::Trace& trace);

/// A sentence for each order that was found: which part of the drive turns that often, and which does not.
/// None for a linear axis.
std::vector<std::string> drive_notes(const identification::Trace& trace, const rig_file::Drive& drive);

/// The id, or of a learned map what it is a function of.
std::string effect_name(const identification::FoundEffect& effect);

/// 0.0123 -> "1.23 %"
std::string percent(double share);

}  // namespace backlash::findings
