// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/simulator_node.h"

#include <ros/callback_queue.h>
#include <ros/console.h>
#include <ros/init.h>
#include <rosgraph_msgs/Clock.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/ros/node_main.h"
#include "backlash_diagnosis/ros/simulated_joint.h"

namespace backlash::ros_bridge {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

constexpr nanoseconds kBurst = 10ms;  // services are answered at least this often
// A subscriber like rosbag record holds 100 messages: samples that are due together go out in smaller
// portions.
constexpr long kPortion = 50;
constexpr nanoseconds kBreath = 1ms;
constexpr nanoseconds kIdle = 20ms;  // longest sleep, so that Ctrl-C ends fast
constexpr nanoseconds kPoll = 1ms;   // of an external /clock
constexpr nanoseconds kTolerableLag = 100ms;
constexpr nanoseconds kWarningInterval = 5s;
constexpr nanoseconds kLinger = 500ms;  // for the last messages; roscpp does not report when they are out

double seconds(nanoseconds t) {
  return std::chrono::duration<double>(t).count();
}

/// Simulated time between two /clock messages: 1 ms, or as long as 1 ms of wall time, but 10 ms at most.
ros::Duration clock_step(double real_time_factor) {
  return ros::Duration(real_time_factor == 0 ? 0.01 : std::clamp(0.001 * real_time_factor, 0.001, 0.01));
}

/// True at most once per `interval` of wall time, whatever ROS time does.
bool due(std::chrono::steady_clock::time_point& next, nanoseconds interval) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next) return false;
  next = now + interval;
  return true;
}

ros::Time wall_time() {
  const ros::WallTime now = ros::WallTime::now();
  return ros::Time(now.sec, now.nsec);
}

/// Subscribers get every sample unless they fall 10 s behind.
std::uint32_t queue_length(double sampling_rate) {
  return static_cast<std::uint32_t>(std::max(1000.0, 10 * sampling_rate));
}

}  // namespace

SimulatorNode::SimulatorNode(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle)
    : settings_(read_simulator_settings(private_handle)),
      pacer_(settings_.real_time_factor * settings_.sampling_rate),
      follows_ros_time_(ros::Time::isSimTime() && !settings_.publish_clock &&
                        settings_.real_time_factor == 1),
      clock_step_(clock_step(settings_.real_time_factor)),
      handle_(handle),
      private_handle_(private_handle),
      updater_(handle, private_handle) {
  advertise();
  updater_.setHardwareID(settings_.rig);
  updater_.add("simulation", this, &SimulatorNode::diagnose);
  last_report_ = next_report_ = next_warning_ = WallClock::now();
}

void SimulatorNode::advertise() {
  if (settings_.arm) machines_.push_back(settings_.arm->make(handle_, private_handle_));
  for (const JointSettings& joint : settings_.joints) {
    const std::string scope = settings_.named_joints ? joint.file.rig.joint : "";
    machines_.push_back(std::make_unique<SimulatedJoint>(joint, ros::NodeHandle(handle_, scope),
                                                         ros::NodeHandle(private_handle_, scope)));
  }
  for (const auto& machine : machines_)
    for (const std::string& topic : machine->topics())
      if (joint_states_.count(topic) == 0)
        joint_states_[topic] =
            handle_.advertise<sensor_msgs::JointState>(topic, queue_length(settings_.sampling_rate));
  if (settings_.publish_clock) {  // latched: who comes before the first sample sees a valid time
    clock_ = handle_.advertise<rosgraph_msgs::Clock>("/clock", 1000, true);
    origin_ = wall_time();
    publish_clock(origin_);
  }
  reset_ = private_handle_.advertiseService("reset", &SimulatorNode::reset, this);
}

int SimulatorNode::run() {
  if (!wait_for_start()) return 0;
  start();
  while (ros::ok() && !finished()) {
    publish_burst();
    warn_if_behind();
    const nanoseconds wait =
        finished() ? nanoseconds(0) : std::max(kBreath, pacer_.wait(published_, elapsed()));
    serve(std::min(wait, follows_ros_time_ ? kPoll : kIdle));
  }
  const auto end = WallClock::now() + kLinger;
  while (ros::ok() && WallClock::now() < end) serve(kIdle);
  return 0;
}

bool SimulatorNode::wait_for_start() {
  while (ros::ok()) {
    // Stamps need a ROS time; the node's own clock gives it.
    const bool no_time = !settings_.publish_clock && !ros::Time::isValid();
    const bool no_subscriber = settings_.wait_for_subscriber &&
                               std::all_of(joint_states_.begin(), joint_states_.end(), [](const auto& topic) {
                                 return topic.second.getNumSubscribers() == 0;
                               });
    if (!no_time && !no_subscriber) return true;
    if (due(next_warning_, kWarningInterval)) {
      if (no_time)
        ROS_WARN("use_sim_time is true: waiting for /clock (publish_clock: true lets this node provide it)");
      else
        ROS_INFO_STREAM("waiting for a subscriber of " << joint_states_.begin()->second.getTopic());
    }
    serve(kIdle);
  }
  return false;
}

void SimulatorNode::start() {
  if (!settings_.publish_clock) origin_ = ros::Time::now();
  next_clock_ = origin_;
  start_ = WallClock::now();
  last_report_ = next_warning_ = start_;
  started_ = true;
  const double factor = settings_.real_time_factor;
  if (factor != 1 && !settings_.publish_clock)
    ROS_WARN_STREAM("stamps run at " << factor
                                     << " times the pace of ROS time, since publish_clock is false");
  const std::string pace = follows_ros_time_ ? "at the pace of /clock"
                           : factor == 0     ? "as fast as possible"
                                             : to_text(factor) + " times real time";
  for (const auto& machine : machines_)
    ROS_INFO_STREAM(machine->title() << " at " << settings_.sampling_rate << " Hz with a backlash of "
                                     << machine->true_backlash() << ", " << pace);
}

nanoseconds SimulatorNode::elapsed() const {
  if (follows_ros_time_) return nanoseconds((ros::Time::now() - origin_).toNSec());
  return WallClock::now() - start_;
}

ros::Time SimulatorNode::stamp(long sample) const {
  ros::Time time;
  time.fromNSec(origin_.toNSec() +
                static_cast<std::uint64_t>(sample_time(sample, settings_.sampling_rate).count()));
  return time;
}

void SimulatorNode::publish_burst() {
  const nanoseconds now = elapsed();
  lag_ = pacer_.lag(published_, now);
  const auto end = WallClock::now() + kBurst;
  for (long count = 0; count < kPortion && !finished() && pacer_.is_due(published_, now); ++count) {
    publish_sample();
    if (WallClock::now() >= end) return;
  }
}

void SimulatorNode::publish_sample() {
  std::map<std::string, sensor_msgs::JointState> messages;
  for (const auto& machine : machines_) machine->step(messages);
  const ros::Time now = stamp(published_);
  if (settings_.publish_clock && now >= next_clock_) {
    publish_clock(now);
    next_clock_ += clock_step_;
  }
  for (auto& [topic, message] : messages) {
    message.header.stamp = now;
    empty_if_absent(message);
    joint_states_.at(topic).publish(message);
  }
  ++published_;
}

void SimulatorNode::publish_clock(const ros::Time& now) {
  rosgraph_msgs::Clock message;
  message.clock = now;
  clock_.publish(message);
}

bool SimulatorNode::ros_time_went_back() const {
  const nanoseconds interval = sample_time(1, settings_.sampling_rate);
  return follows_ros_time_ && pacer_.wait(published_, elapsed()) > interval + kTolerableLag;
}

void SimulatorNode::warn_if_behind() {
  if (lag_ > kTolerableLag) {
    if (due(next_warning_, kWarningInterval))
      ROS_WARN_STREAM("the simulation is " << seconds(lag_)
                                           << " s behind; no sample is left out and the stamps stay "
                                           << "right (lower real_time_factor or sampling_rate)");
  } else if (ros_time_went_back()) {
    if (due(next_warning_, kWarningInterval))
      ROS_WARN_STREAM("ROS time went back to "
                      << ros::Time::now() << "; the simulation goes on when it reaches " << stamp(published_)
                      << " again");
  }
}

void SimulatorNode::serve(nanoseconds longest) {
  ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(seconds(longest)));
  const std::chrono::duration<double> period(settings_.diagnostic_period);
  if (due(next_report_, std::chrono::duration_cast<nanoseconds>(period))) updater_.force_update();
}

void SimulatorNode::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) {
  using diagnostic_msgs::DiagnosticStatus;
  if (!started_)
    status.summary(DiagnosticStatus::OK, "waiting to start");
  else if (lag_ > kTolerableLag)
    status.summaryf(DiagnosticStatus::WARN, "%.3g s behind", seconds(lag_));
  else
    status.summary(DiagnosticStatus::OK, "running");
  const auto now = WallClock::now();
  const double wall = seconds(now - last_report_);
  const double simulated = (published_ - reported_) / settings_.sampling_rate;
  simulation::IntegratorStatistics statistics;
  for (const auto& machine : machines_) {
    const simulation::IntegratorStatistics one = machine->statistics();
    statistics.steps += one.steps;
    statistics.evaluations += one.evaluations;
    statistics.error_test_failures += one.error_test_failures;
  }
  status.add("lag [s]", seconds(lag_));
  status.add("samples published", published_);
  status.add("real time factor demanded", settings_.real_time_factor);
  status.add("real time factor reached", wall > 0 ? simulated / wall : 0.0);
  status.add("integrator steps", statistics.steps);
  status.add("integrator evaluations", statistics.evaluations);
  status.add("integrator error test failures", statistics.error_test_failures);
  last_report_ = now;
  reported_ = published_;
}

bool SimulatorNode::reset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  response.success = true;
  response.message = "at rest; backlash is ";
  for (const auto& machine : machines_) {
    machine->reset();
    response.message += (machine == machines_.front() ? "" : ", ") + machine->true_backlash();
  }
  ROS_INFO_STREAM("reset: " << response.message);
  return true;
}

int simulator_main(int argc, char** argv) {
  return node_main(argc, argv, "simulator", simulator_help(),
                   [] { return SimulatorNode(ros::NodeHandle(), ros::NodeHandle("~")).run(); });
}

}  // namespace backlash::ros_bridge
