// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/trace_server.h"

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/ros/trace_job.h"

namespace backlash {
namespace {

using Result = backlash_diagnosis::TraceResidualResult;

Result to_result(const TraceDone& done) {
  Result result;
  result.success = true;
  result.message = verdict_sentence(done.trace);
  result.verdict = to_string(done.trace.verdict);
  result.report = done.files.page;
  result.augmented_rig = done.files.rig;
  for (const auto& [name, c] : done.trace.channels) {
    backlash_diagnosis::TracedChannel channel;
    channel.name = name;
    channel.before = c.before;
    channel.after = c.after;
    channel.floor = c.floor;
    result.channels.push_back(channel);
  }
  for (const FoundEffect& e : done.trace.steps) {
    backlash_diagnosis::TracedEffect effect;
    effect.id = e.id;
    effect.channel = e.channel;
    effect.error_before = e.test_error_before;
    effect.error_after = e.test_error_after;
    effect.equivalent_to = e.equivalent_to;
    result.effects.push_back(effect);
  }
  result.warnings = done.trace.warnings;
  return result;
}

}  // namespace

TraceServer::TraceServer(const ros::NodeHandle& handle, const std::string& name, FindRig find_rig,
                         FileFolder folder)
    : find_rig_(std::move(find_rig)),
      folder_(std::move(folder)),
      server_(std::make_unique<Server>(
          handle, name, [this](const auto& goal) { execute(goal); }, false)) {
  server_->start();
}

TraceServer::~TraceServer() {
  server_->shutdown();
}

Result TraceServer::trace(const backlash_diagnosis::TraceResidualGoal& goal) {
  TraceJob job;
  if (goal.train.empty()) throw InvalidParameter("train", "[]", "must name at least one record");
  for (const std::string& path : goal.train) job.train.push_back(folder_.inside("train", path));
  job.test = folder_.inside("test", goal.test);
  job.folder = folder_.inside("out", goal.out);
  if (!(goal.cutoff >= 0) || !std::isfinite(goal.cutoff))
    throw InvalidParameter("cutoff", goal.cutoff, "must be >= 0 Hz");
  if (goal.rig.empty()) {
    std::string why;
    const RigFile* rig = find_rig_(goal.joint, why);
    if (!rig) throw InvalidParameter("joint", goal.joint, why);
    job.rig = *rig;
  } else {
    job.rig = load_rig_file(folder_.inside("rig", goal.rig));
  }
  job.settings.cutoff = goal.cutoff;
  const ros::WallTime start = ros::WallTime::now();
  std::string best;
  job.settings.best_so_far = [&](const std::string& found) { best = found; };
  return to_result(run_trace(job, [&](double fraction, const std::string& phase) {
    backlash_diagnosis::TraceResidualFeedback feedback;
    feedback.phase = phase;
    feedback.fraction = fraction;
    feedback.elapsed = (ros::WallTime::now() - start).toSec();
    feedback.best = best;
    server_->publishFeedback(feedback);
    return ros::ok() && !server_->isPreemptRequested();
  }));
}

void TraceServer::execute(const backlash_diagnosis::TraceResidualGoalConstPtr& goal) {
  Result result;
  try {
    result = trace(*goal);
    server_->setSucceeded(result, result.message);
  } catch (const Cancelled& error) {
    result.message = error.what();
    server_->setPreempted(result, result.message);
  } catch (const std::exception& error) {
    result.message = error.what();
    server_->setAborted(result, result.message);
  }
}

}  // namespace backlash
