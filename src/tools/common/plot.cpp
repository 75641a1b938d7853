// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/plot.h"

#include <filesystem>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/report/script.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

namespace fs = std::filesystem;

/// Runs `name --out OUT -- DATA`; `what` is in the data file, whatever happens to the picture. Empty:
/// nowhere.
void draw(const std::string& name, const std::string& out, const std::string& data, const std::string& what) {
  const int code = report::run_script(name, {"--out", out, "--", data});
  const std::string kept = what.empty() ? "" : "; " + what + " itself is in " + data;
  if (code == kCannotWrite) throw CannotWrite(out + ": cannot be written" + kept);
  if (code != kHealthy) throw Error(name + " failed (exit code " + std::to_string(code) + ")" + kept);
}

/// The same of data that no file keeps.
void draw_text(const std::string& name, const std::string& out, const std::string& json) {
  const ScratchFolder scratch;
  const std::string data = scratch.path("data.json");
  write_text(data, json);
  draw(name, out, data, "");
}

}  // namespace

void check_plot_path(const std::string& path) {
  const std::string extension = fs::path(path).extension();
  if (extension != ".png" && extension != ".svg" && extension != ".pdf")
    throw UsageError("'" + printable(path, 4096) + "': a plot must end in .png, .svg or .pdf");
}

void plot_curve(const std::string& curve_path, const std::string& picture_path) {
  draw("plot_curve.py", picture_path, curve_path, "the curve");
}

void plot_integrator_study(const std::string& json_path, const std::string& prefix) {
  draw("plot_integrator_study.py", prefix, json_path, "the study");
}

void plot_uncertainty_study(const std::string& json_path, const std::string& picture_path) {
  draw("plot_uncertainty_study.py", picture_path, json_path, "the study");
}

void plot_identification(const std::string& json_path, const std::string& picture_path) {
  draw("plot_identification.py", picture_path, json_path, "the identification");
}

void plot_model_comparison(const std::string& json_path, const std::string& picture_path) {
  draw("plot_model_comparison.py", picture_path, json_path, "the comparison");
}

void plot_separability_map(const std::string& json_path, const std::string& picture_path) {
  draw("plot_separability_map.py", picture_path, json_path, "the map");
}

void plot_trend(const std::string& json, const std::string& picture_path) {
  draw_text("plot_trend.py", picture_path, json);
}

void plot_check(const std::string& series, const std::string& picture_path) {
  draw_text("plot_check.py", picture_path, series);
}

}  // namespace backlash::tools
