// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/trace_files.h"

#include <filesystem>

namespace backlash::report {

TraceFiles trace_files(const std::string& folder) {
  const std::filesystem::path in(folder);
  return {(in / "report.json").string(), (in / "series.json").string(), (in / "rig.yaml").string(),
          (in / "report.html").string()};
}

}  // namespace backlash::report
