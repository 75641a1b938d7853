// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/trace_server.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/report/trace_files.h"
#include "backlash_diagnosis/ros/job.h"

namespace backlash::ros_bridge {
namespace {

using Result = backlash_diagnosis::TraceResidualResult;

constexpr int kDone = 0, kUnexplained = 3;  // exit codes of the command

double number(const nlohmann::json& json) {
  return json.is_number() ? json.get<double>() : kNaN;
}

/// What the command has left behind.
Result read_result(const report::TraceFiles& files) {
  nlohmann::json report;
  open_input(files.report) >> report;
  Result result;
  result.success = true;
  result.message = report.at("message");
  result.verdict = report.at("verdict");
  result.report = files.page;
  result.augmented_rig = files.rig;
  for (const auto& [name, c] : report.at("channels").items()) {
    backlash_diagnosis::TracedChannel channel;
    channel.name = name;
    channel.before = number(c.at("before"));
    channel.after = number(c.at("after"));
    channel.floor = number(c.at("floor"));
    result.channels.push_back(channel);
  }
  for (const auto& step : report.at("steps")) {
    backlash_diagnosis::TracedEffect effect;
    effect.id = step.at("effect");
    effect.channel = step.at("channel");
    effect.error_before = number(step.at("test_error_before"));
    effect.error_after = number(step.at("test_error_after"));
    effect.equivalent_to = step.at("equivalent_to").get<std::vector<std::string>>();
    result.effects.push_back(effect);
  }
  result.warnings = report.at("warnings").get<std::vector<std::string>>();
  return result;
}

}  // namespace

TraceServer::TraceServer(const ros::NodeHandle& handle, const std::string& name, FindRig find_rig,
                         FileFolder folder, double memory)
    : find_rig_(std::move(find_rig)),
      folder_(std::move(folder)),
      memory_(memory),
      server_(std::make_unique<Server>(
          handle, name, [this](const auto& goal) { execute(goal); }, false)) {
  server_->start();
}

TraceServer::~TraceServer() {
  server_->shutdown();
}

Result TraceServer::trace(const backlash_diagnosis::TraceResidualGoal& goal) {
  if (goal.train.empty()) throw InvalidParameter("train", "[]", "must name at least one record");
  if (!(goal.cutoff >= 0) || !std::isfinite(goal.cutoff))
    throw InvalidParameter("cutoff", goal.cutoff, "must be >= 0 Hz");
  const ScratchFolder scratch;
  Job job;
  job.words = {command_path("trace_residual"), "--feedback", "--train"};
  for (const std::string& path : goal.train) job.words.push_back(folder_.inside("train", path));
  const std::string out = folder_.inside("out", goal.out);
  job.words.insert(job.words.end(), {"--test", folder_.inside("test", goal.test), "--out", out});
  job.words.insert(job.words.end(), {"--rig", rig_path(goal, scratch)});
  if (goal.cutoff > 0) job.words.insert(job.words.end(), {"--cutoff", to_text(goal.cutoff)});
  job.done = {kDone, kUnexplained};
  job.memory = memory_;
  const ros::WallTime start = ros::WallTime::now();
  std::string best;
  job.best_so_far = [&best](const std::string& found) { best = found; };
  job.progress = [&](double fraction, const std::string& phase) {
    backlash_diagnosis::TraceResidualFeedback feedback;
    feedback.phase = phase;
    feedback.fraction = fraction;
    feedback.elapsed = (ros::WallTime::now() - start).toSec();
    feedback.best = best;
    server_->publishFeedback(feedback);
    return ros::ok() && !server_->isPreemptRequested();
  };
  run_job(job);
  return read_result(report::trace_files(out));
}

std::string TraceServer::rig_path(const backlash_diagnosis::TraceResidualGoal& goal,
                                  const ScratchFolder& scratch) const {
  if (!goal.rig.empty()) return folder_.inside("rig", goal.rig);
  std::string why;
  const rig_file::RigFile* rig = find_rig_(goal.joint, why);
  if (!rig) throw InvalidParameter("joint", goal.joint, why);
  return file_of(*rig, scratch);
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

}  // namespace backlash::ros_bridge
