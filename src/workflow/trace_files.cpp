// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/workflow/trace_files.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iterator>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/script.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/workflow/traced_rig.h"

namespace backlash {
namespace {

namespace fs = std::filesystem;

const char* const kScript = "trace_report.py";

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
  throw CannotWrite(printable(path, 4096) + ": cannot be written: " + reason);
}

/// Figures as a piece of HTML, or why there are none.
std::string drawn(const TraceFiles& files, const std::string& folder) {
  const std::string out = (fs::path(folder) / ".figures.html").string();
  std::string plots;
  try {
    const int code = run_script(kScript, {"--series", files.series, "--out", out, "--", files.report});
    if (code != 0)
      throw Error(std::string(kScript) + " ended with exit code " + std::to_string(code) +
                  (code == 70 ? ": matplotlib or numpy is missing (Debian: python3-matplotlib)" : ""));
    std::ifstream in = open_input(out);
    plots.assign(std::istreambuf_iterator<char>(in), {});
  } catch (const Error& error) {
    plots = "<p>No plots were drawn: " + html_text(error.what()) + ".</p>\n";
  }
  std::error_code ignored;
  fs::remove(out, ignored);
  return plots;
}

}  // namespace

TraceFiles trace_files(const std::string& folder) {
  const fs::path in(folder);
  return {(in / "report.json").string(), (in / "series.json").string(), (in / "rig.yaml").string(),
          (in / "report.html").string()};
}

TraceFolder::TraceFolder(const std::string& folder, const std::vector<std::string>& inputs)
    : folder_(folder), files_(trace_files(folder)) {
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

void TraceFolder::write(const Trace& trace, const RigFile& declared, const TraceInputs& inputs) const {
  write_file(files_.report, trace_report_json(trace, inputs));
  write_file(files_.series, trace_series_json(trace));
  write_file(files_.rig, traced_rig_text(declared, trace));
  write_file(files_.page, trace_page(trace, inputs, drawn(files_, folder_)));
}

}  // namespace backlash
