// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <iostream>

#include "backlash_diagnosis/arm/trace.h"
#include "backlash_diagnosis/arm_findings/arm_report.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/findings/trace_folder.h"
#include "backlash_diagnosis/report/report_page.h"
#include "tools/arm/arm_commands.h"
#include "tools/arm/arm_record.h"
#include "tools/common/exit_codes.h"
#include "tools/common/feedback.h"
#include "tools/common/progress_bar.h"

namespace backlash::tools {
namespace {

namespace fs = std::filesystem;

report::Provenance provenance_of(const arm::ArmRig& rig, const findings::TraceInputs& inputs,
                                 const std::string& folder) {
  report::Provenance p;
  p.command = {"trace_residual", "--rig", inputs.rig, "--train"};
  p.command.insert(p.command.end(), inputs.train.begin(), inputs.train.end());
  p.command.insert(p.command.end(), {"--test", inputs.test, "--out", folder});
  p.files.push_back({"rig, as declared", inputs.rig});
  p.files.push_back({"robot", rig.urdf});
  for (const std::string& record : inputs.train) p.files.push_back({"record for training", record});
  p.files.push_back({"record for the test", inputs.test});
  p.rig_source = inputs.rig + ", as declared; with what was found it is rig.yaml beside this page";
  p.rig_text = rig.text;
  p.seeds = "1, for the blocks of time that are drawn";
  return p;
}

void write_trace(const findings::TraceFolder& folder, const arm::ArmTrace& trace, const arm::ArmRig& rig,
                 const findings::TraceInputs& inputs, const std::string& name, const RecordDoor& door) {
  const report::TraceFiles& files = folder.files();
  write_file(files.report, door.with_findings(arm_findings::arm_trace_json(trace, inputs)));
  write_file(files.series, arm_findings::arm_series_json(trace));
  write_file(files.rig, arm::arm_rig_text(trace.augmented,
                                          {"What trace_residual found is in report.json beside this file.",
                                           "SPDX-License-Identifier: BSD-3-Clause"}));
  const std::string plots =
      report::drawn_figures("arm_report.py", {"--series", files.series, "--", files.report});
  write_file(files.page,
             arm_findings::arm_trace_page(trace, inputs, plots,
                                          report::provenance_sections(provenance_of(rig, inputs, name))));
}

arm::ArmTrace run_trace(const Arguments& arguments, RecordDoor& door, const Progress& progress) {
  const findings::TraceInputs inputs = {arguments.text("rig"), arguments.texts("train"),
                                        arguments.text("test")};
  const arm::ArmRig rig = arm::load_arm_rig(inputs.rig);
  std::vector<arm::ArmRecord> train;
  std::error_code error;
  bool same = false;
  for (const std::string& path : inputs.train) {
    train.push_back(admitted_arm_record(path, rig, door));
    same = same || fs::equivalent(path, inputs.test, error);
  }
  const arm::ArmRecord test = admitted_arm_record(inputs.test, rig, door);
  std::vector<std::string> files = inputs.train;
  files.insert(files.end(), {inputs.test, inputs.rig, rig.urdf});
  const findings::TraceFolder folder(arguments.text("out"), files);
  arm::ArmTrace trace = arm::trace_arm(rig, train, test, same, {}, progress);
  if (progress && !progress(1, "writing the report")) throw Cancelled();
  for (const arm::ArmRecord& record : train)
    for (const std::string& warning : record.warnings) trace.warnings.push_back(record.name + ": " + warning);
  for (const std::string& warning : test.warnings) trace.warnings.push_back(test.name + ": " + warning);
  write_trace(folder, trace, rig, inputs, arguments.text("out"), door);
  return trace;
}

}  // namespace

int trace_arm_residual(const Arguments& arguments, RecordDoor& door) {
  arm::ArmTrace trace;
  try {
    if (arguments.has("feedback")) {
      FeedbackLines lines;
      trace = run_trace(arguments, door, lines.progress());
    } else {
      ProgressBar bar;
      trace = run_trace(arguments, door, bar.progress());
    }
  } catch (const CannotIdentify& error) {
    std::cerr << "trace_residual: " << error.what() << '\n';
    return kInconclusive;
  }
  const report::TraceFiles files = report::trace_files(arguments.text("out"));
  if (!arguments.has("feedback")) {
    arm_findings::print_arm_trace(trace, std::cout);
    std::cout << "\nreport: " << files.page << ", " << files.report
              << "\nrig with what was found: " << files.rig << '\n';
  }
  return trace.unexplained || trace.cannot_tell ? kInconclusive : kHealthy;
}

}  // namespace backlash::tools
