// SPDX-License-Identifier: BSD-3-Clause
// The folder that a search for missing effects leaves behind.
#pragma once

#include <string>

#include "backlash_diagnosis/findings/trace_report.h"
#include "backlash_diagnosis/report/record_check_report.h"
#include "backlash_diagnosis/report/trace_files.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::findings {

/// Makes the folder (and those above it) that the files go to, and takes it away again where the work fails.
class TraceFolder {
 public:
  /// Throws CannotWrite where that is impossible, or a file would replace one of `inputs`.
  TraceFolder(const std::string& folder, const std::vector<std::string>& inputs);
  /// Removes the folder where it is new and empty.
  ~TraceFolder();
  TraceFolder(const TraceFolder&) = delete;
  TraceFolder& operator=(const TraceFolder&) = delete;

  const report::TraceFiles& files() const { return files_; }

  /// Writes all; `checks` of the records go into the report. Plots are drawn by a Python script; where that
  /// fails the page says so instead. Throws CannotWrite, and BadData as traced_rig_text().
  void write(const identification::Trace& trace, const rig_file::RigFile& declared, const TraceInputs& inputs,
             const std::vector<report::CheckedFile>& checks = {}) const;

 private:
  std::string folder_;
  report::TraceFiles files_;
  bool new_ = false;
};

/// The page; `plots` is what the script drew, or a sentence on why there is nothing; `provenance` ends it.
std::string trace_page(const identification::Trace& trace, const TraceInputs& inputs,
                       const std::string& plots, const std::string& provenance);

}  // namespace backlash::findings
