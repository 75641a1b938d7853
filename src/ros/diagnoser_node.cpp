// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/diagnoser_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/baseline.h"
#include "backlash_diagnosis/ros/curve_job.h"
#include "backlash_diagnosis/ros/joint_rigs.h"
#include "backlash_diagnosis/ros/messages.h"
#include "backlash_diagnosis/ros/node_main.h"
#include "backlash_diagnosis/ros/parameters.h"

namespace backlash::ros_bridge {
namespace {

constexpr int kTick = 100;  // ms: a change of level is published so soon
constexpr int kTicks = 10;  // from one report on /diagnostics to the next without a change
std::vector<record::ChannelMap> channels_of(const std::vector<MonitorSettings>& joints) {
  std::vector<record::ChannelMap> maps;
  for (const MonitorSettings& joint : joints) maps.push_back(JointRig{joint.joint, joint.rig}.channels());
  return maps;
}

void require(bool condition, const std::string& name, double value, const std::string& limit) {
  if (!std::isfinite(value) || !condition) throw InvalidParameter(name, value, limit);
}

}  // namespace

DiagnoserNode::DiagnoserNode(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                             DiagnoserSettings settings)
    : handle_(handle),
      private_handle_(private_handle),
      folder_("~folder", settings.folder),
      job_memory_(settings.job_memory),
      inputs_(channels_of(settings.joints)),
      updater_(handle, private_handle) {
  for (const std::string& topic : inputs_.topics()) topics_.push_back(handle_.resolveName(topic));
  updater_.setHardwareID("none");  // each joint has its own
  serve_live(settings);
  advertise();
  ros::NodeHandle samples(handle_);
  samples.setCallbackQueue(&sample_queue_);
  for (std::size_t i = 0; i < inputs_.topics().size(); ++i)
    subscribers_.push_back(samples.subscribe<sensor_msgs::JointState>(
        inputs_.topics()[i], settings.queue,
        [this, i](const sensor_msgs::JointState::ConstPtr& message) { on_joint_state(i, *message); },
        ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay()));
}

DiagnoserNode::~DiagnoserNode() {
  if (curve_server_) curve_server_->shutdown();
  for (Joint& joint : joints_) joint.monitor->stop();  // they publish
}

void DiagnoserNode::add_joint(MonitorSettings settings, const DiagnoserSettings& common) {
  Joint joint;
  const model::Mesh& mesh = settings.rig.rig.mesh;
  const auto& limits = settings.rig.diagnosis.limits;
  if (!common.history.empty())
    joint.history = std::make_unique<JointHistory>(
        JointHistory::Settings{joint_path(common.history, settings.joint, ".csv"), common.history_interval,
                               limits ? limits->angular : mesh.angular(), settings.rig.digest});
  settings.job_memory = common.job_memory;
  settings.silent = common.diagnostics.stale;
  if (!common.waveform) settings.rig.diagnosis.leave_out_waveform();
  joint.monitor = std::make_unique<JointMonitor>(
      std::move(settings),
      [this, place = joints_.size()](const ros::Time& stamp, const diagnosis::Diagnosis& diagnosis) {
        publish(joints_[place], stamp, diagnosis);
      },
      &fits_);
  joint.diagnostics = std::make_unique<JointDiagnostics>(*joint.monitor, joint.history.get(), joined(topics_),
                                                         common.diagnostics);
  joint.diagnostics->add_to(updater_);
  joints_.push_back(std::move(joint));
}

void DiagnoserNode::serve_live(const DiagnoserSettings& settings) {
  for (const MonitorSettings& joint : settings.joints) add_joint(joint, settings);
  Live live = Live::__getDefault__();
  live.window = settings.joints.front().window;
  live.estimate_interval = settings.joints.front().estimate_interval;
  live.stale = settings.diagnostics.stale;
  live.hold = settings.diagnostics.hold;
  live.latency_limit = settings.diagnostics.latency_limit;
  live_ = std::make_unique<LiveServer<Live>>(private_handle_, live,
                                             [this](const Live& wanted) { apply(wanted); });
  for (Joint& joint : joints_) {
    JointLive limits = JointLive::__getDefault__();
    if (const auto in_force = joint.monitor->limits()) {
      limits.watch = in_force->watch;
      limits.service = in_force->service;
      limits.stop = in_force->stop;
    }
    joint.live = std::make_unique<LiveServer<JointLive>>(
        ros::NodeHandle(private_handle_, joint.monitor->joint()), limits,
        [this, &joint](const JointLive& wanted) { apply(joint, wanted); });
  }
}

void DiagnoserNode::apply(const Live& wanted) {
  require(wanted.window >= 1, "window", wanted.window, "must be >= 1");
  require(wanted.estimate_interval >= 0, "estimate_interval", wanted.estimate_interval, "must be >= 0 s");
  require(wanted.stale > 0, "stale", wanted.stale, "must be > 0 s");
  require(wanted.hold >= 0, "hold", wanted.hold, "must be >= 0 s");
  require(wanted.latency_limit > 0, "latency_limit", wanted.latency_limit, "must be > 0 s");
  for (Joint& joint : joints_) {
    joint.monitor->set_window(wanted.window, wanted.estimate_interval);
    joint.diagnostics->set({wanted.stale, wanted.hold, wanted.latency_limit});
  }
}

void DiagnoserNode::apply(Joint& joint, const JointLive& wanted) {
  if (wanted.watch == 0 && wanted.service == 0 && wanted.stop == 0) {
    joint.monitor->set_limits(std::nullopt);
    return;
  }
  const auto& declared = joint.monitor->rig().diagnosis.limits;
  diagnosis::Limits limits;
  limits.angular = declared ? declared->angular : joint.monitor->rig().rig.mesh.angular();
  limits.watch = wanted.watch;
  limits.service = wanted.service;
  limits.stop = wanted.stop;
  diagnosis::require_increasing(limits);
  joint.monitor->set_limits(limits);
}

void DiagnoserNode::advertise() {
  distributions_ =
      handle_.advertise<backlash_diagnosis::AmplitudeDistribution>("amplitude_distribution", 100);
  estimates_ = handle_.advertise<backlash_diagnosis::BacklashEstimate>("backlash_estimate", 100);
  services_ = {private_handle_.advertiseService("diagnose", &DiagnoserNode::on_diagnose, this),
               private_handle_.advertiseService("set_baseline", &DiagnoserNode::on_set_baseline, this),
               private_handle_.advertiseService("get_curve", &DiagnoserNode::on_get_curve, this)};
  curve_server_ = std::make_unique<CurveServer>(
      private_handle_, "build_curve", [this](const auto& goal) { on_build_curve(goal); }, false);
  curve_server_->start();
  trace_server_ = std::make_unique<TraceServer>(
      private_handle_, "trace_residual",
      [this](const std::string& joint, std::string& why) -> const rig_file::RigFile* {
        const JointMonitor* monitor = find_monitor(joint, why);
        return monitor ? &monitor->rig() : nullptr;
      },
      folder_, job_memory_);
}

void DiagnoserNode::run() {
  ros::AsyncSpinner samples(1, &sample_queue_);
  ros::AsyncSpinner requests(4);  // waiting requests each hold a thread
  samples.start();
  requests.start();
  // By wall time: also while a simulated clock stands still.
  for (int tick = 0; ros::ok(); tick = (tick + 1) % kTicks) {
    bool changed = false;
    for (Joint& joint : joints_) changed = joint.diagnostics->update() || changed;
    if (changed || tick == 0) updater_.force_update();
    if (tick == 0) write_histories();
    ros::WallDuration(1e-3 * kTick).sleep();
  }
  samples.stop();
  fits_.stop();
  for (Joint& joint : joints_) joint.monitor->stop();
  write_histories();
}

void DiagnoserNode::write_histories() {
  for (Joint& joint : joints_) {
    if (!joint.history) continue;
    const auto limits = joint.monitor->limits();
    const auto baseline = joint.monitor->baseline();
    std::optional<double> service;
    if (limits) service = limits->service;
    if (limits && baseline) *service += limits->angular ? baseline->backlash_angle : baseline->backlash;
    joint.history->flush(service);
  }
}

void DiagnoserNode::on_joint_state(std::size_t topic, const sensor_msgs::JointState& message) {
  inputs_.take(topic, message,
               [&](std::size_t joint, const ros::Time& stamp, const record::ChannelValues& values,
                   const std::string& problem) {
                 const auto report = joints_[joint].monitor->take(stamp, values, problem, topics_[topic]);
                 if (report) publish(joints_[joint], *report);
               });
}

void DiagnoserNode::publish(const Joint& joint, const PeriodReport& report) {
  const JointMonitor& monitor = *joint.monitor;
  auto m = to_message(report.period, *monitor.rig().diagnosis.apd, report.period_length);
  m.header.stamp = report.stamp;
  m.joint = monitor.joint();
  distributions_.publish(m);
}

/// In the thread of the joint.
void DiagnoserNode::publish(const Joint& joint, const ros::Time& stamp,
                            const diagnosis::Diagnosis& diagnosis) {
  if (joint.history) joint.history->take(stamp.toSec(), diagnosis);
  for (const diagnosis::Estimate& estimate : diagnosis.estimates) {
    auto m = to_message(estimate, stamp);
    m.joint = joint.monitor->joint();
    estimates_.publish(m);
  }
}

DiagnoserNode::Joint* DiagnoserNode::find(const std::string& name, std::string& why) {
  if (name.empty() && joints_.size() == 1) return &joints_.front();
  std::vector<std::string> names;
  for (Joint& joint : joints_) {
    if (joint.monitor->joint() == name) return &joint;
    names.push_back(joint.monitor->joint());
  }
  why = (name.empty() ? "several joints, name one: " : "unknown joint '" + printable(name) + "', known: ") +
        joined(names);
  return nullptr;
}

JointMonitor* DiagnoserNode::find_monitor(const std::string& name, std::string& why) {
  const Joint* joint = find(name, why);
  return joint ? joint->monitor.get() : nullptr;
}

bool DiagnoserNode::on_diagnose(backlash_diagnosis::Diagnose::Request& request,
                                backlash_diagnosis::Diagnose::Response& response) {
  response.verdict = to_message(diagnosis::Verdict(), {});
  const Joint* joint = find(request.joint, response.message);
  if (!joint) return true;
  JointMonitor* const monitor = joint->monitor.get();
  if (!(request.timeout >= 0) || request.timeout > 1e6) {
    response.message = "timeout = " + to_text(request.timeout) + ": must be between 0 and 1e6 s";
    return true;
  }
  std::string note;
  ros::Time stamp;
  const diagnosis::Diagnosis diagnosis = monitor->diagnose(request.periods, request.timeout, note, stamp);
  if (diagnosis.estimates.empty()) {
    response.message = joint->diagnostics->input();
    return true;
  }
  response.verdict = to_message(diagnosis.verdict, diagnosis.estimates);
  for (const diagnosis::Estimate& estimate : diagnosis.estimates) {
    response.estimates.push_back(to_message(estimate, stamp));
    response.estimates.back().joint = monitor->joint();
  }
  if (diagnosis.apd) response.distribution = to_message(*diagnosis.apd, *monitor->rig().diagnosis.apd);
  response.distribution.header.stamp = stamp;
  response.distribution.joint = monitor->joint();
  response.success = diagnosis.verdict.estimate >= 0 && note.empty();
  response.message = note.empty() ? diagnosis.verdict.message : note + "; " + diagnosis.verdict.message;
  const MonitorState state = monitor->state();
  for (const std::string& warning : state.warnings()) response.message += "; warning: " + warning;
  if (const std::string silence = joint->diagnostics->silence(state); !silence.empty())
    response.message += "; " + silence;
  return true;
}

bool DiagnoserNode::on_set_baseline(backlash_diagnosis::SetBaseline::Request& request,
                                    backlash_diagnosis::SetBaseline::Response& response) {
  response.backlash = response.backlash_angle = response.skewness = kNaN;
  Joint* joint = find(request.joint, response.message);
  if (!joint) return true;
  try {
    if (request.clear)
      clear_baseline(*joint->monitor, response);
    else
      set_baseline(*joint, response);
  } catch (const Error& error) {
    response.message = error.what();
  }
  return true;
}

void DiagnoserNode::clear_baseline(JointMonitor& monitor,
                                   backlash_diagnosis::SetBaseline::Response& response) {
  const std::string& path = monitor.baseline_path();
  std::error_code error;
  if (!path.empty()) std::filesystem::remove(path, error);
  if (error) throw CannotWrite(path + ": cannot be removed: " + error.message());
  monitor.set_baseline(std::nullopt);
  response.success = true;
  response.message = "baseline forgotten";
}

void DiagnoserNode::set_baseline(Joint& joint, backlash_diagnosis::SetBaseline::Response& response) {
  JointMonitor& monitor = *joint.monitor;
  std::string note;
  ros::Time stamp;
  const diagnosis::Diagnosis diagnosis = monitor.diagnose(0, 0, note, stamp);
  if (diagnosis.estimates.empty()) note = joint.diagnostics->input();
  if (note.empty()) note = monitor.change_of_play();
  if (!note.empty()) {
    response.message = "no baseline set: " + note;
    return;
  }
  const rig_file::RigFile& rig = monitor.rig();
  const diagnosis::Baseline baseline = diagnosis::baseline_of(diagnosis, rig.rig.name, rig.digest);
  const std::string& path = monitor.baseline_path();
  if (!path.empty())
    diagnosis::write_baseline(
        baseline, path);  // first, so that a baseline that could not be written is not used either
  monitor.set_baseline(baseline);
  if (joint.history) joint.history->take_baseline(stamp.toSec(), diagnosis);
  response.success = true;
  response.message = "baseline by " + joined(baseline.methods) + (path.empty() ? "" : ", kept in " + path);
  response.backlash = baseline.backlash;
  response.backlash_angle = baseline.backlash_angle;
  response.skewness = baseline.skewness;
}

bool DiagnoserNode::on_get_curve(backlash_diagnosis::GetCurve::Request& request,
                                 backlash_diagnosis::GetCurve::Response& response) {
  JointMonitor* monitor = find_monitor(request.joint, response.message);
  if (!monitor) return true;
  const auto curve = monitor->curve();
  response.success = curve != nullptr;
  const MonitorState state = monitor->state();
  response.message = state.curve_state;
  for (const std::string& warning : state.warnings()) response.message += "; warning: " + warning;
  if (curve) response.curve = to_message(*curve);
  return true;
}

diagnosis::MonitoringCurve DiagnoserNode::built_curve(const backlash_diagnosis::BuildCurveGoal& goal,
                                                      JointMonitor& monitor) {
  studies::CurveRequest request;
  if (goal.points > 0) request.points = static_cast<int>(goal.points);
  if (goal.max_backlash != 0) request.max_backlash = goal.max_backlash;
  if (goal.periods > 0) request.periods = static_cast<int>(goal.periods);
  request.sampling_rate = goal.sampling_rate;
  std::string path, best;
  if (!goal.save_as.empty()) path = folder_.inside("save_as", goal.save_as);
  request.best_so_far = [&best](const std::string& found) { best = found; };
  const ros::WallTime start = ros::WallTime::now();
  const auto progress = [&](double fraction, const std::string& phase) {
    backlash_diagnosis::BuildCurveFeedback feedback;
    feedback.phase = phase;
    feedback.fraction = fraction;
    feedback.elapsed = (ros::WallTime::now() - start).toSec();
    feedback.best = best;
    curve_server_->publishFeedback(feedback);
    return ros::ok() && !curve_server_->isPreemptRequested();
  };
  diagnosis::MonitoringCurve curve = build_curve_as_job(monitor.rig(), request, job_memory_, progress);
  if (!path.empty()) {
    folder_.create();
    diagnosis::write_curve(curve, path);
  }
  monitor.set_curve(curve);
  return curve;
}

void DiagnoserNode::on_build_curve(const backlash_diagnosis::BuildCurveGoalConstPtr& goal) {
  backlash_diagnosis::BuildCurveResult result;
  JointMonitor* monitor = find_monitor(goal->joint, result.message);
  if (!monitor) {
    curve_server_->setAborted(result, result.message);
    return;
  }
  try {
    const diagnosis::MonitoringCurve curve = built_curve(*goal, *monitor);
    result.success = true;
    result.message = fmt::format("built with {} points", curve.points.size());
    result.curve = to_message(curve);
    curve_server_->setSucceeded(result, result.message);
  } catch (const Cancelled& error) {
    result.message = error.what();
    curve_server_->setPreempted(result, result.message);
  } catch (const std::exception& error) {
    result.message = error.what();
    curve_server_->setAborted(result, result.message);
  }
}

int diagnoser_main(int argc, char** argv) {
  return node_main(argc, argv, "diagnoser", diagnoser_help(), [] {
    const ros::NodeHandle handle, private_handle("~");
    DiagnoserNode(handle, private_handle, load_diagnoser_settings(private_handle)).run();
    return 0;
  });
}

}  // namespace backlash::ros_bridge
