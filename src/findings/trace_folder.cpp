// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/findings/trace_folder.h"

#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/effects/traced_rig.h"
#include "backlash_diagnosis/report/report_page.h"

namespace backlash::findings {
namespace {

namespace fs = std::filesystem;

const char* const kScript = "trace_report.py";

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
  throw CannotWrite(printable(path, 4096) + ": cannot be written: " + reason);
}

/// The command that repeats the trace, also where an action asked for it.
report::Provenance provenance_of(const identification::Trace& trace, const rig_file::RigFile& declared,
                                 const TraceInputs& inputs, const std::string& folder) {
  report::Provenance p;
  p.command = {"trace_residual", "--rig", inputs.rig, "--train"};
  p.command.insert(p.command.end(), inputs.train.begin(), inputs.train.end());
  p.command.insert(p.command.end(), {"--test", inputs.test});
  if (std::isfinite(trace.cutoff)) p.command.insert(p.command.end(), {"--cutoff", to_text(trace.cutoff)});
  p.command.insert(p.command.end(), {"--out", folder});
  p.files.push_back({"rig, as declared", inputs.rig});
  for (const std::string& record : inputs.train) p.files.push_back({"record for training", record});
  p.files.push_back({"record for the test", inputs.test});
  p.rig_source = inputs.rig + ", as declared; with the effects added it is rig.yaml beside this page";
  p.rig_text = declared.text;
  return p;
}

}  // namespace

TraceFolder::TraceFolder(const std::string& folder, const std::vector<std::string>& inputs)
    : folder_(folder), files_(report::trace_files(folder)) {
  std::error_code error;
  for (const std::string& file : {files_.report, files_.series, files_.rig, files_.page}) {
    for (const std::string& input : inputs)
      if (fs::equivalent(file, input, error)) fail(file, "it is one of the inputs");
    if (fs::is_directory(file, error)) fail(file, "is a directory");
  }
  if (fs::exists(folder_, error) && !fs::is_directory(folder_, error)) fail(folder_, "is no folder");
  new_ = fs::create_directories(folder_, error);
  if (error) fail(folder_, error.message());
  if (::access(folder_.c_str(), W_OK | X_OK) != 0) fail(folder_, std::strerror(errno));
}

TraceFolder::~TraceFolder() {
  if (new_) ::rmdir(folder_.c_str());  // refuses where there is something in it
}

void TraceFolder::write(const identification::Trace& trace, const rig_file::RigFile& declared,
                        const TraceInputs& inputs, const std::vector<report::CheckedFile>& checks) const {
  write_file(files_.report, report::with_record_check(trace_report_json(trace, inputs), checks));
  write_file(files_.series, trace_series_json(trace));
  write_file(files_.rig, identification::traced_rig_text(declared, trace));
  const std::string plots = report::drawn_figures(kScript, {"--series", files_.series, "--", files_.report});
  const std::string provenance = report::provenance_sections(provenance_of(trace, declared, inputs, folder_));
  write_file(files_.page, trace_page(trace, inputs, plots, provenance));
}

}  // namespace backlash::findings
