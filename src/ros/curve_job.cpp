// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/curve_job.h"

#include <fmt/format.h>

#include <cmath>

#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/ros/job.h"

namespace backlash::ros_bridge {

diagnosis::MonitoringCurve build_curve_as_job(const rig_file::RigFile& rig,
                                              const studies::CurveRequest& request, double memory,
                                              const Progress& progress) {
  if (!(request.max_backlash > 0) || !std::isfinite(request.max_backlash))
    throw InvalidParameter("max_backlash", request.max_backlash, "must be > 0 and finite");
  if (!(request.sampling_rate >= 0) || !std::isfinite(request.sampling_rate))
    throw InvalidParameter("sampling_rate", request.sampling_rate, "must be >= 0 Hz and finite");
  if (request.points < 2) throw InvalidParameter("points", request.points, "must be >= 2");
  const ScratchFolder scratch;
  const std::string out = scratch.path("curve.yaml");
  Job job;
  job.words = {command_path("build_curve"), file_of(rig, scratch), "--out", out, "--feedback"};
  const auto add = [&job](const char* option, const std::string& value) {
    job.words.insert(job.words.end(), {option, value});
  };
  add("--points", fmt::to_string(request.points));
  add("--max-backlash", to_text(request.max_backlash));
  add("--periods", fmt::to_string(request.periods));
  add("--seeds", fmt::to_string(request.seeds));
  if (request.sampling_rate > 0) add("--sample-rate", to_text(request.sampling_rate));
  job.memory = memory;
  job.progress = progress;
  job.best_so_far = request.best_so_far;
  run_job(job);
  return diagnosis::read_curve(out);
}

}  // namespace backlash::ros_bridge
