// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/arm/change_watch_node.h"

#include <fmt/format.h>
#include <malloc.h>

#include <chrono>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/utc.h"
#include "backlash_diagnosis/report/change_file.h"
#include "backlash_diagnosis/ros/messages.h"
#include "backlash_diagnosis/ros/node_main.h"

namespace backlash::ros_bridge {
namespace {

using DiagnosticStatus = diagnostic_msgs::DiagnosticStatus;

constexpr int kLargeCopy = 1 << 20;  // bytes; choice: a minute of one channel at 2 kHz
constexpr double kTick = 1;          // s of wall time from one report on /diagnostics to the next

std::vector<record::ChannelMap> channels_of(const std::vector<WatchSettings>& joints) {
  std::vector<record::ChannelMap> maps;
  for (const WatchSettings& joint : joints)
    for (record::ChannelMap& map : joint.channels()) maps.push_back(std::move(map));
  return maps;
}

std::string joint_of(const diagnosis::KnownChange& change, const JointWatch& watch) {
  return change.found.joint.empty() ? watch.joint() : change.found.joint;
}

/// The changes in a state, in words; empty: none.
std::string changes_in(diagnosis::ChangeState wanted, const WatchState& state) {
  std::vector<std::string> texts;
  for (const diagnosis::KnownChange& c : state.changes)
    if (c.state == wanted) texts.push_back(report::change_text(c.found));
  return joined(texts);
}

}  // namespace

ChangeWatchNode::ChangeWatchNode(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                                 const ChangeWatchSettings& settings)
    : handle_(handle),
      stale_(settings.stale),
      look_share_(settings.look_share),
      inputs_(channels_of(settings.joints)),
      updater_(handle, private_handle) {
  for (const std::string& topic : inputs_.topics()) topics_.push_back(handle_.resolveName(topic));
  updater_.setHardwareID("none");  // each joint has its own
  for (const WatchSettings& joint : settings.joints) {
    for (std::size_t j = 0; j < joint.channels().size(); ++j) places_.push_back({joints_.size(), j});
    joints_.push_back(std::make_unique<JointWatch>(joint));
    updater_.add(joints_.back()->joint() + ": model",
                 [this, watch = joints_.back().get()](Status& status) { describe(*watch, status); });
  }
  changes_ = handle_.advertise<backlash_diagnosis::ChangeReport>("changes", 10, true);
  ros::NodeHandle samples(handle_);
  samples.setCallbackQueue(&sample_queue_);
  for (std::size_t i = 0; i < inputs_.topics().size(); ++i)
    subscribers_.push_back(samples.subscribe<sensor_msgs::JointState>(
        inputs_.topics()[i], settings.queue,
        [this, i](const sensor_msgs::JointState::ConstPtr& message) { on_joint_state(i, *message); },
        ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay()));
  looks_ = std::thread([this] { look(); });
}

ChangeWatchNode::~ChangeWatchNode() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
    due_changed_.notify_all();
  }
  looks_.join();
}

void ChangeWatchNode::run() {
  ros::AsyncSpinner samples(1, &sample_queue_), requests(1);
  samples.start();
  requests.start();
  // By wall time: also while a simulated clock stands still.
  while (ros::ok()) {
    updater_.force_update();
    ros::WallDuration(kTick).sleep();
  }
  samples.stop();
}

void ChangeWatchNode::on_joint_state(std::size_t topic, const sensor_msgs::JointState& message) {
  inputs_.take(topic, message,
               [&](std::size_t joint, const ros::Time& stamp, const record::ChannelValues& values,
                   const std::string& problem) {
                 const Place& place = places_[joint];
                 if (!joints_[place.watch]->take(stamp, values, problem, topics_[topic], place.joint)) return;
                 const std::lock_guard<std::mutex> lock(mutex_);
                 due_ = true;
                 due_changed_.notify_all();
               });
}

/// The thread of the looks: one joint after the other, so that a robot of many joints takes one processor at
/// most, and that at the lowest priority.
void ChangeWatchNode::look() {
  const Progress go_on = [this](double, const std::string&) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return !stop_;
  };
  while (true) {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      due_changed_.wait(lock, [this] { return due_ || stop_; });
      if (stop_) return;
      due_ = false;
    }
    try {
      for (const auto& joint : joints_) {
        const ros::WallTime begin = ros::WallTime::now();
        if (const auto news = joint->look(go_on); !news.empty()) publish(news, *joint);
        if (!pause_after((ros::WallTime::now() - begin).toSec())) return;
      }
    } catch (const Cancelled&) {
      return;
    }
  }
}

/// Waits so that looks run no more than their share of the time. False where the node ends.
bool ChangeWatchNode::pause_after(double seconds) {
  std::unique_lock<std::mutex> lock(mutex_);
  const std::chrono::duration<double> pause(seconds * (1 / look_share_ - 1));
  return !due_changed_.wait_for(lock, pause, [this] { return stop_; });
}

void ChangeWatchNode::publish(const std::vector<diagnosis::KnownChange>& news, const JointWatch& of) {
  backlash_diagnosis::ChangeReport message;
  message.header.stamp = to_stamp(of.state().to);
  for (const diagnosis::KnownChange& change : news) {
    message.news.push_back(to_message(change, joint_of(change, of)));
    ROS_WARN("%s: %s: %s", of.joint().c_str(), diagnosis::to_string(change.state),
             report::change_text(change.found).c_str());
  }
  for (const auto& joint : joints_)
    for (const diagnosis::KnownChange& change : joint->state().changes)
      message.changes.push_back(to_message(change, joint_of(change, *joint)));
  changes_.publish(message);
}

void ChangeWatchNode::describe(const JointWatch& joint, Status& status) const {
  const WatchState state = joint.state();
  status.hardware_id =
      joint.settings().arm ? joint.settings().arm->name : joint.settings().joint.rig.rig.name;
  const double silent = state.any_sample ? (ros::WallTime::now() - state.last_arrival).toSec() : 0;
  const std::string unseen = changes_in(diagnosis::ChangeState::unseen, state);
  if (const std::string changed = changes_in(diagnosis::ChangeState::standing, state); !changed.empty())
    status.summary(DiagnosticStatus::WARN, "changed: " + changed);
  else if (!state.any_sample)
    status.summary(DiagnosticStatus::STALE,
                   "cannot tell, because there is no sample yet on " + joined(topics_) +
                       (state.last_problem.empty() ? "" : ": " + state.last_problem));
  else if (silent > stale_)
    status.summary(DiagnosticStatus::STALE,
                   fmt::format("cannot tell, because there is no sample for {:.0f} s", silent));
  else if (!state.why_not.empty())
    status.summary(DiagnosticStatus::STALE, "cannot tell, because " + state.why_not);
  else if (!state.different.empty())
    status.summary(DiagnosticStatus::WARN, "differs from the healthy machine by " + joined(state.different) +
                                               " since before " + utc_time(state.from) +
                                               ": the onset is unknown");
  else
    status.summary(DiagnosticStatus::OK, "as commissioned, up to " + utc_time(state.to) +
                                             (state.unjudged.empty() ? "" : ", but for joints not judged") +
                                             (unseen.empty() ? "" : "; no longer seen: " + unseen));
  const WatchSettings& settings = joint.settings();
  status.add("Healthy machine", state.healthy.empty() ? "being learned" : state.healthy);
  status.addf("False alarms", "%s per hour and look", to_text(settings.rate).c_str());
  status.addf("Window", "%g s, each %g s", settings.window, settings.check_interval);
  status.add("Last look up to", state.judged > 0 ? utc_time(state.to) : "");
  status.add("Windows of motion judged", state.windows);
  status.add("Joints not judged", joined(state.unjudged));
  status.add("Looks", state.looks);
  status.add("Looks with an answer", state.judged);
  status.add("Looks left out", state.left_out);
  status.add("Last look", state.why_not.empty() ? "has an answer" : state.why_not);
  status.add("Samples", state.counters.taken);
  status.add("Samples not a number", state.counters.not_a_number);
  status.add("Stamps repeated", state.counters.repeated);
  status.add("Stamps out of order", state.counters.late);
  status.add("Jumps of the clock", state.counters.restarts);
  status.add("Last jump", state.counters.last_jump);
  status.add("Messages that are wrong", state.bad_messages);
  status.add("Last wrong message", state.last_problem);
  status.add("Changes reported", state.changes.size());
  status.add("History", state.log_problem.empty() ? settings.log : state.log_problem);
}

int change_watch_main(int argc, char** argv) {
  // Copies of a record go back to the system after each look. Without a fixed threshold the allocator keeps
  // the most that it ever needed, which looks like a leak.
  mallopt(M_MMAP_THRESHOLD, kLargeCopy);
  return node_main(argc, argv, "change_watch", change_watch_help(), [] {
    const ros::NodeHandle handle, private_handle("~");
    ChangeWatchNode(handle, private_handle, load_change_watch_settings(private_handle)).run();
    return 0;
  });
}

}  // namespace backlash::ros_bridge
