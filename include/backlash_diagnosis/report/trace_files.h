// SPDX-License-Identifier: BSD-3-Clause
// What a search for missing effects leaves behind in its folder.
#pragma once

#include <string>

namespace backlash::report {

struct TraceFiles {
  std::string report;  // report.json
  std::string series;  // series.json, for plots
  std::string rig;     // rig.yaml, the augmented rig
  std::string page;    // report.html, self-contained
};

/// Their paths in a folder.
TraceFiles trace_files(const std::string& folder);

}  // namespace backlash::report
