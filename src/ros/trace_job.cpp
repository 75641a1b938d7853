// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/trace_job.h"

#include <filesystem>

#include "backlash_diagnosis/identification/effects/traced_rig.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/ros/bag_record.h"

namespace backlash {
namespace {

Record read(const std::string& path, const std::string& joint, std::vector<std::string>& warnings) {
  const std::filesystem::path file(path);
  Record record = file.extension() == ".bag" ? read_bag(path, joint, "joint_states") : read_csv(path);
  record.name = file.filename();
  for (const std::string& warning : record.warnings) warnings.push_back(record.name + ": " + warning);
  return record;
}

}  // namespace

TraceDone run_trace(const TraceJob& job, const Progress& progress) {
  check_traced_rig_text(job.rig);
  std::vector<std::string> inputs = job.train, warnings;
  std::vector<Record> train;
  for (const std::string& path : job.train) train.push_back(read(path, job.rig.rig.joint, warnings));
  const Record test = read(job.test, job.rig.rig.joint, warnings);
  inputs.push_back(job.test);
  inputs.push_back(job.rig.source);
  const TraceFolder folder(job.folder, inputs);
  TraceDone done{trace_residual(job.rig.rig, train, test, job.settings, progress), folder.files()};
  done.trace.warnings.insert(done.trace.warnings.begin(), warnings.begin(), warnings.end());
  if (progress && !progress(1, "writing the report")) throw Cancelled();
  folder.write(done.trace, job.rig, {job.rig.source, job.train, job.test});
  return done;
}

}  // namespace backlash
