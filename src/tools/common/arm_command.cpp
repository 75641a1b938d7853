// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/arm_command.h"

#include <algorithm>
#include <filesystem>
#include <iostream>

#include "backlash_diagnosis/arm/fit_records.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/findings/arm_report.h"
#include "backlash_diagnosis/findings/trace_folder.h"
#include "backlash_diagnosis/report/report_page.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "backlash_diagnosis/ros/joint_rigs.h"
#include "tools/common/exit_codes.h"
#include "tools/common/feedback.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_file.h"

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
  write_file(files.report, door.with_findings(findings::arm_trace_json(trace, inputs)));
  write_file(files.series, findings::arm_series_json(trace));
  write_file(files.rig, arm::arm_rig_text(trace.augmented,
                                          {"What trace_residual found is in report.json beside this file.",
                                           "SPDX-License-Identifier: BSD-3-Clause"}));
  const std::string plots =
      report::drawn_figures("arm_report.py", {"--series", files.series, "--", files.report});
  write_file(files.page,
             findings::arm_trace_page(trace, inputs, plots,
                                      report::provenance_sections(provenance_of(rig, inputs, name))));
}

arm::ArmTrace run_trace(const Arguments& arguments, const Progress& progress) {
  const findings::TraceInputs inputs = {arguments.text("rig"), arguments.texts("train"),
                                        arguments.text("test")};
  const arm::ArmRig rig = arm::load_arm_rig(inputs.rig);
  std::vector<arm::ArmRecord> train;
  RecordDoor door("trace_residual");
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

std::vector<record::JointRecord> read_joints(const std::string& path, const arm::ArmRig& rig) {
  check_record_path(path);
  std::vector<record::JointRecord> joints;
  if (fs::path(path).extension() != ".csv") {
    for (const arm::JointDrive& joint : rig.joints)
      joints.push_back({joint.name, ros_bridge::read_robot_bag(
                                        path, ros_bridge::robot_channels(joint.name, rig.channel))});
  } else {
    joints = record::read_joints_csv(path);
  }
  return joints;
}

arm::ArmRecord admitted_arm_record(const std::string& path, const arm::ArmRig& rig, RecordDoor& door) {
  return arm::arm_record(door.admit(read_joints(path, rig), path), rig, fs::path(path).filename());
}

int identify_arm(const Arguments& arguments, RecordDoor& door) {
  const arm::ArmRig rig = arm::load_arm_rig(arguments.text("rig"));
  std::vector<arm::RecordMotions> records;
  std::vector<std::string> warnings;
  for (const std::string& path : arguments.positionals()) {
    const arm::ArmRecord record = admitted_arm_record(path, rig, door);
    for (const std::string& warning : record.warnings) warnings.push_back(record.name + ": " + warning);
    records.push_back(arm::motions_of(record, rig, warnings));
  }
  ProgressBar bar;
  arm::ArmFit fit = arm::fit_records(rig, records, {}, bar.progress());
  fit.warnings.insert(fit.warnings.end(), warnings.begin(), warnings.end());
  write_text(arguments.text("out"), findings::fitted_arm_text(fit, arguments.positionals()));
  write_text(arguments.text("json"), door.with_findings(findings::arm_identification_json(
                                         fit, arguments.text("rig"), arguments.positionals())));
  findings::print_arm_summary(fit, std::cout);
  return fit.contradictions.empty() ? kHealthy : kInconclusive;
}

int trace_arm_residual(const Arguments& arguments) {
  arm::ArmTrace trace;
  try {
    if (arguments.has("feedback")) {
      FeedbackLines lines;
      trace = run_trace(arguments, lines.progress());
    } else {
      ProgressBar bar;
      trace = run_trace(arguments, bar.progress());
    }
  } catch (const CannotIdentify& error) {
    std::cerr << "trace_residual: " << error.what() << '\n';
    return kInconclusive;
  }
  const report::TraceFiles files = report::trace_files(arguments.text("out"));
  if (!arguments.has("feedback")) {
    findings::print_arm_trace(trace, std::cout);
    std::cout << "\nreport: " << files.page << ", " << files.report
              << "\nrig with what was found: " << files.rig << '\n';
  }
  return trace.unexplained || trace.cannot_tell ? kInconclusive : kHealthy;
}

}  // namespace backlash::tools
