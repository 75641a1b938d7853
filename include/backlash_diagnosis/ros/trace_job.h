// SPDX-License-Identifier: BSD-3-Clause
// From paths to a folder with the report: what the command trace_residual does, which the action
// TraceResidual runs.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/report/trace_files.h"

namespace backlash {

struct TraceJob {
  RigFile rig;                     // the declared machine
  std::vector<std::string> train;  // paths of .csv or .bag
  std::string test;
  std::string folder;  // for what comes out
  TraceSettings settings;
};

struct TraceDone {
  Trace trace;  // with the readers' warnings
  TraceFiles files;
};

/// Throws MissingInput, BadData, CannotWrite, CannotIdentify, Cancelled; nothing is written then.
TraceDone run_trace(const TraceJob& job, const Progress& progress);

}  // namespace backlash
