// SPDX-License-Identifier: BSD-3-Clause
// Says what the model of a machine lacks, from records of it.
#include <algorithm>
#include <filesystem>
#include <iostream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/findings/trace_folder.h"
#include "backlash_diagnosis/identification/effects/traced_rig.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/rig_file/declared_motion.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/feedback.h"
#include "tools/common/for_arm.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_door.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

Command command() {
  Command c;
  c.name = "trace_residual";
  c.summary =
      "Says whether the declared model of a machine lacks something, what, and how much smaller the error on "
      "an "
      "unseen record becomes with it; writes a report and the rig with the effect added.";
  c.options = {
      {"rig", "RIG.yaml", "the machine as declared: structure, and values to start from (within some 40 %)",
       true},
      {"train", "RECORD...", "records (.csv or .bag) that the model is fitted to", true},
      {"test", "RECORD", "another record of the same machine, on which errors are given", true},
      {"out", "DIR",
       "folder for report.json, report.html, rig.yaml and series.json; made where it is missing", true},
      {"cutoff", "HZ",
       "low-pass of all residuals [Hz]; default: 1.36 times the mesh resonance of two inertias, else the "
       "wider of the bandwidths of motion and torque"},
      feedback_option(),
  };
  c.notes =
      "Two inertias with a mesh between them need motor_torque, motor_position and load_position; one "
      "inertia "
      "(mesh: rigid) and a locked link need motor_torque and motor_position. Records of "
      "a "
      "higher rate are brought to that of the slowest. DIR/rig.yaml can be simulated at once. All parameters "
      "are those of the load side of the "
      "reduction. Of an arm (a rig file with urdf, records with columns JOINT/channel) payload, direction of "
      "gravity, friction of a joint and pushes are traced; the test record may be of a machine that has "
      "changed: then effects are fitted to its first half and judged on its second.";
  c.examples = {
      "trace_residual --rig config/two_inertia_servo.yaml --train run1.csv run2.csv --test run3.csv "
      "--out report",
      "trace_residual --rig config/emps.yaml --train emps_train.csv --test emps_validation.csv --out report "
      "--cutoff 40"};
  c.exit_codes =
      "  0   done: nothing is missing, or the effects that are were found and added\n"
      "  3   something is missing that no effect explains, be it beside effects that were found; or the "
      "records do not determine the machine (report.json says why)\n";
  return c;
}

struct TraceJob {
  rig_file::RigFile rig;           // the declared machine
  std::vector<std::string> train;  // paths of .csv or .bag
  std::string test;
  std::string folder;  // for what comes out
  identification::TraceSettings settings;
};

TraceJob job_of(const Arguments& arguments) {
  TraceJob job;
  job.train = arguments.texts("train");
  job.test = arguments.text("test");
  job.folder = arguments.text("out");
  job.settings.cutoff = arguments.number("cutoff", 0, Range::positive());
  std::vector<std::string> inputs = job.train;
  inputs.insert(inputs.end(), {job.test, arguments.text("rig")});
  for (const std::string& record : job.train) check_record_path(record);
  check_record_path(job.test);
  if (std::filesystem::is_directory(job.folder)) {
    const report::TraceFiles files = report::trace_files(job.folder);
    for (const std::string& file : {files.report, files.series, files.rig, files.page})
      check_output(file, inputs);
  }
  job.rig = rig_file::load_rig_file(arguments.text("rig"));
  return job;
}

record::Record read(const std::string& path, const rig_file::RigFile& rig) {
  record::Record record = read_record(path, place_of(rig));
  record.name = std::filesystem::path(path).filename();
  return record;
}

record::Record longest(std::vector<record::Record> parts) {
  const std::vector<std::string> warnings = parts.front().warnings;
  record::Record part = *std::max_element(parts.begin(), parts.end(), [](const auto& a, const auto& b) {
    return a.time.back() - a.time.front() < b.time.back() - b.time.front();
  });
  part.warnings = warnings;
  return part;
}

/// With the readers' warnings. Throws MissingInput, BadData, CannotWrite, CannotIdentify (records that do not
/// serve), Cancelled; nothing is written then.
identification::Trace run_trace(const TraceJob& job, RecordDoor& door, const Progress& progress) {
  identification::check_traced_rig_text(job.rig);
  std::vector<std::string> inputs = job.train, warnings;
  std::vector<record::Record> train;
  const record::DeclaredMotion declared = rig_file::declared_motion(job.rig.rig);
  for (const std::string& path : job.train)
    for (record::Record& stretch : door.admit_stretches(read(path, job.rig), declared, path))
      for (record::Record& part : record::parts_between_gaps(std::move(stretch)))
        train.push_back(std::move(part));
  const record::Record test =
      longest(record::parts_between_gaps(door.admit(read(job.test, job.rig), declared, job.test)));
  for (const record::Record& record : train)
    for (const std::string& warning : record.warnings) warnings.push_back(record.name + ": " + warning);
  for (const std::string& warning : test.warnings) warnings.push_back(test.name + ": " + warning);
  inputs.push_back(job.test);
  inputs.push_back(job.rig.source);
  const findings::TraceFolder folder(job.folder, inputs);
  identification::Trace trace =
      identification::trace_residual(job.rig.rig, train, test, job.settings, progress);
  trace.warnings.insert(trace.warnings.begin(), warnings.begin(), warnings.end());
  if (job.rig.drive)
    for (const std::string& note : findings::drive_notes(trace, *job.rig.drive)) trace.notes.push_back(note);
  if (progress && !progress(1, "writing the report")) throw Cancelled();
  folder.write(trace, job.rig, {job.rig.source, job.train, job.test}, door.files());
  return trace;
}

int trace(const Arguments& arguments) {
  RecordDoor door("trace_residual");
  if (rig_file::is_arm_rig(arguments.text("rig"))) {
    if (arguments.has("cutoff")) throw UsageError("--cutoff: the rig file of an arm says it (torque_cutoff)");
    return run_for_arm(arguments, door);
  }
  TraceJob job = job_of(arguments);
  identification::Trace done;
  try {
    if (arguments.has("feedback")) {
      FeedbackLines lines;
      job.settings.best_so_far = lines.best_so_far();
      done = run_trace(job, door, lines.progress());
    } else {
      ProgressBar bar;
      done = run_trace(job, door, bar.progress());
    }
  } catch (const CannotIdentify& error) {
    std::cerr << "trace_residual: " << error.what() << '\n';
    return kBadData;
  }
  const report::TraceFiles files = report::trace_files(job.folder);
  if (!arguments.has("feedback"))
    std::cout << findings::trace_summary(done) << "\nreport: " << files.page << ", " << files.report
              << "\nrig with what was found: " << files.rig << '\n';
  return done.verdict == identification::TraceVerdict::unexplained || done.unexplained ? kInconclusive
                                                                                       : kHealthy;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, trace);
}
