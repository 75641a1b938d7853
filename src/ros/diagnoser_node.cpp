// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/diagnoser_node.h"

#include <cmath>
#include <filesystem>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/ros/messages.h"
#include "backlash_diagnosis/ros/parameters.h"
#include "backlash_diagnosis/workflow/healthy_machine.h"

namespace backlash {
namespace {

using DiagnosticStatus = diagnostic_msgs::DiagnosticStatus;

unsigned char level(Grade grade) {
  switch (grade) {
    case Grade::good:
      return DiagnosticStatus::OK;
    case Grade::watch:
      return DiagnosticStatus::WARN;
    case Grade::service:
    case Grade::stop:
      return DiagnosticStatus::ERROR;
    case Grade::cannot_tell:
      break;
  }
  return DiagnosticStatus::WARN;
}

std::vector<std::string> names_of(const std::vector<MonitorSettings>& joints) {
  std::vector<std::string> names;
  for (const MonitorSettings& joint : joints) names.push_back(joint.joint);
  return names;
}

}  // namespace

DiagnoserNode::DiagnoserNode(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                             DiagnoserSettings settings)
    : handle_(handle),
      private_handle_(private_handle),
      stale_(settings.stale),
      reader_(names_of(settings.joints)),
      updater_(handle, private_handle) {
  for (MonitorSettings& joint : settings.joints)
    monitors_.push_back(std::make_unique<JointMonitor>(std::move(joint)));
  topic_ = handle_.resolveName("joint_states");
  advertise();
  add_diagnostics();
  ros::NodeHandle samples(handle_);
  samples.setCallbackQueue(&sample_queue_);
  subscriber_ = samples.subscribe("joint_states", settings.queue, &DiagnoserNode::on_joint_state, this,
                                  ros::TransportHints().tcpNoDelay());
}

DiagnoserNode::~DiagnoserNode() {
  if (curve_server_) curve_server_->shutdown();
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
  trace_server_ =
      std::make_unique<TraceServer>(private_handle_, "trace_residual",
                                    [this](const std::string& joint, std::string& why) -> const RigFile* {
                                      const JointMonitor* monitor = find(joint, why);
                                      return monitor ? &monitor->rig() : nullptr;
                                    });
}

void DiagnoserNode::run() {
  ros::AsyncSpinner samples(1, &sample_queue_);
  ros::AsyncSpinner requests(4);  // waiting requests each hold a thread
  samples.start();
  requests.start();
  // Once a second by wall time: also while a simulated clock stands still.
  for (int tenth = 0; ros::ok(); tenth = (tenth + 1) % 10) {
    if (tenth == 0) updater_.force_update();
    ros::WallDuration(0.1).sleep();
  }
}

void DiagnoserNode::on_joint_state(const sensor_msgs::JointState::ConstPtr& message) {
  for (const std::size_t joint : reader_.read(*message)) {
    JointMonitor& monitor = *monitors_[joint];
    const auto report =
        monitor.take(message->header.stamp, reader_.values(joint), reader_.problem(joint), topic_);
    if (report) publish(monitor, *report);
  }
}

void DiagnoserNode::publish(const JointMonitor& monitor, const PeriodReport& report) {
  if (report.period) {
    auto m = to_message(*report.period, *monitor.rig().diagnosis.apd, report.period_length);
    m.header.stamp = report.stamp;
    m.joint = monitor.joint();
    distributions_.publish(m);
  }
  if (!report.diagnosis) return;
  for (const Estimate& estimate : report.diagnosis->estimates) {
    auto m = to_message(estimate);
    m.header.stamp = report.stamp;
    m.joint = monitor.joint();
    estimates_.publish(m);
  }
}

JointMonitor* DiagnoserNode::find(const std::string& joint, std::string& why) {
  if (joint.empty() && monitors_.size() == 1) return monitors_.front().get();
  std::vector<std::string> names;
  for (const auto& monitor : monitors_) {
    if (monitor->joint() == joint) return monitor.get();
    names.push_back(monitor->joint());
  }
  why = (joint.empty() ? "several joints, name one: " : "unknown joint '" + printable(joint) + "', known: ") +
        joined(names);
  return nullptr;
}

bool DiagnoserNode::on_diagnose(backlash_diagnosis::Diagnose::Request& request,
                                backlash_diagnosis::Diagnose::Response& response) {
  response.verdict = to_message(Verdict(), {});
  JointMonitor* monitor = find(request.joint, response.message);
  if (!monitor) return true;
  if (!(request.timeout >= 0) || request.timeout > 1e6) {
    response.message = "timeout = " + to_text(request.timeout) + ": must be between 0 and 1e6 s";
    return true;
  }
  std::string note;
  ros::Time stamp;
  const Diagnosis diagnosis = monitor->diagnose(request.periods, request.timeout, note, stamp);
  response.verdict = to_message(diagnosis.verdict, diagnosis.estimates);
  for (const Estimate& estimate : diagnosis.estimates) {
    response.estimates.push_back(to_message(estimate));
    response.estimates.back().header.stamp = stamp;
    response.estimates.back().joint = monitor->joint();
  }
  if (diagnosis.apd) response.distribution = to_message(*diagnosis.apd, *monitor->rig().diagnosis.apd);
  response.distribution.header.stamp = stamp;
  response.distribution.joint = monitor->joint();
  response.success = diagnosis.verdict.estimate >= 0 && note.empty();
  response.message = note.empty() ? diagnosis.verdict.message : note + "; " + diagnosis.verdict.message;
  for (const std::string& warning : monitor->state().warnings) response.message += "; warning: " + warning;
  return true;
}

bool DiagnoserNode::on_set_baseline(backlash_diagnosis::SetBaseline::Request& request,
                                    backlash_diagnosis::SetBaseline::Response& response) {
  response.backlash = response.backlash_angle = response.skewness = kNaN;
  JointMonitor* monitor = find(request.joint, response.message);
  if (!monitor) return true;
  try {
    if (request.clear)
      clear_baseline(*monitor, response);
    else
      set_baseline(*monitor, response);
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

void DiagnoserNode::set_baseline(JointMonitor& monitor, backlash_diagnosis::SetBaseline::Response& response) {
  std::string note;
  ros::Time stamp;
  const Diagnosis diagnosis = monitor.diagnose(0, 0, note, stamp);
  if (!note.empty()) {
    response.message = "no baseline set: " + note;
    return;
  }
  const RigFile& rig = monitor.rig();
  const Baseline baseline = baseline_of(diagnosis, rig.rig.name, rig.digest);
  const std::string& path = monitor.baseline_path();
  if (!path.empty()) write_baseline(baseline, path);  // first: what is not kept is not used either
  monitor.set_baseline(baseline);
  response.success = true;
  response.message = "baseline by " + joined(baseline.methods) + (path.empty() ? "" : ", kept in " + path);
  response.backlash = baseline.backlash;
  response.backlash_angle = baseline.backlash_angle;
  response.skewness = baseline.skewness;
}

bool DiagnoserNode::on_get_curve(backlash_diagnosis::GetCurve::Request& request,
                                 backlash_diagnosis::GetCurve::Response& response) {
  JointMonitor* monitor = find(request.joint, response.message);
  if (!monitor) return true;
  const auto curve = monitor->curve();
  response.success = curve != nullptr;
  const MonitorState state = monitor->state();
  response.message = state.curve_state;
  for (const std::string& warning : state.warnings) response.message += "; warning: " + warning;
  if (curve) response.curve = to_message(*curve);
  return true;
}

void DiagnoserNode::on_build_curve(const backlash_diagnosis::BuildCurveGoalConstPtr& goal) {
  backlash_diagnosis::BuildCurveResult result;
  JointMonitor* monitor = find(goal->joint, result.message);
  if (!monitor) {
    curve_server_->setAborted(result, result.message);
    return;
  }
  const ros::WallTime start = ros::WallTime::now();
  const auto progress = [&](double fraction, const std::string& phase) {
    backlash_diagnosis::BuildCurveFeedback feedback;
    feedback.phase = phase;
    feedback.fraction = fraction;
    feedback.elapsed = (ros::WallTime::now() - start).toSec();
    curve_server_->publishFeedback(feedback);
    return ros::ok() && !curve_server_->isPreemptRequested();
  };
  try {
    CurveRequest request;
    if (goal->points > 0) request.points = static_cast<int>(goal->points);
    if (goal->max_backlash != 0) request.max_backlash = goal->max_backlash;
    if (goal->periods > 0) request.periods = static_cast<int>(goal->periods);
    request.sampling_rate = goal->sampling_rate;
    const MonitoringCurve curve = build_curve(monitor->rig(), request, progress);
    if (!goal->save_as.empty()) write_curve(curve, goal->save_as);
    monitor->set_curve(curve);
    result.success = true;
    result.message = "built with " + std::to_string(curve.points.size()) + " points";
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

void DiagnoserNode::add_diagnostics() {
  updater_.setHardwareID(monitors_.front()->rig().rig.name);
  for (const auto& monitor : monitors_) {
    JointMonitor* m = monitor.get();
    updater_.add(m->joint() + ": backlash", [this, m](auto& status) { report_backlash(*m, status); });
    updater_.add(m->joint() + ": input", [this, m](auto& status) { report_input(*m, status); });
  }
}

void DiagnoserNode::report_backlash(JointMonitor& monitor,
                                    diagnostic_updater::DiagnosticStatusWrapper& status) const {
  const MonitorState state = monitor.state();
  status.add("Monitoring curve", state.curve_state);
  for (const std::string& warning : state.warnings) status.add("Warning", warning);
  status.add("Whole periods kept", state.periods);
  status.add("Excitation period (s)", state.period);
  if (!state.latest) {
    status.summary(DiagnosticStatus::WARN, "no whole excitation period yet");
    return;
  }
  const Verdict& verdict = state.latest->verdict;
  status.summary(level(verdict.grade), verdict.message);
  status.add("Grade", to_string(verdict.grade));
  status.add("Agreement", verdict.agreement);
  for (const Estimate& e : state.latest->estimates) {
    status.add(e.method + " status", to_string(e.status));
    status.add(e.method + " backlash (m)", e.backlash);
    status.add(e.method + " backlash angle (rad)", e.backlash_angle);
  }
}

void DiagnoserNode::report_input(JointMonitor& monitor,
                                 diagnostic_updater::DiagnosticStatusWrapper& status) const {
  const MonitorState state = monitor.state();
  const StreamCounters& c = state.counters;
  const double age = state.any_sample ? (ros::WallTime::now() - state.last_arrival).toSec() : 0;
  if (!state.any_sample && state.bad_messages + c.not_a_number == 0)
    status.summary(DiagnosticStatus::WARN,
                   "no message on " + topic_ + " has named " + monitor.joint() + " yet");
  else if (!state.any_sample)
    status.summary(DiagnosticStatus::ERROR, "no usable sample; " + state.last_problem);
  else if (age > stale_)
    status.summary(DiagnosticStatus::STALE, "no message for " + to_text(std::round(age)) + " s");
  else if (!state.last_problem.empty())
    status.summary(DiagnosticStatus::WARN, "samples were left out; last: " + state.last_problem);
  else
    status.summary(DiagnosticStatus::OK, "receiving");
  status.add("Sampling rate (Hz)", state.rate);
  status.add("Samples accepted", c.accepted);
  status.add("Samples with NaN", c.not_a_number);
  status.add("Repeated stamps", c.repeated);
  status.add("Clock jumps", c.restarts);
  status.add("Malformed messages", state.bad_messages);
  status.add("Last problem", state.last_problem);
}

}  // namespace backlash
