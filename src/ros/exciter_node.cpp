// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/exciter_node.h"

#include <fmt/format.h>
#include <ros/master.h>
#include <std_msgs/Float64.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <thread>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "backlash_diagnosis/ros/node_main.h"

namespace backlash::ros_bridge {
namespace {

constexpr int kZeros = 5;                           // messages at the end of a run; choice
constexpr std::chrono::milliseconds kZeroStep{20};  // between them, so that each leaves the process; choice
constexpr std::chrono::milliseconds kLook{200};     // at the master, other publishers and signals; choice
constexpr int kMissed = 2;                          // looks in a row until the master counts as lost; choice
constexpr double kFeedbackInterval = 0.1;           // s; choice
constexpr int kMasterLost = 70;                     // exit code, as of an internal error

// Set by the handler of a signal; the default handler of roscpp would close the topics before the zeros are
// out.
volatile std::sig_atomic_t signalled = 0;

void on_signal(int signal) {
  signalled = signal;
}

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

ros::Time wall_time() {
  const ros::WallTime now = ros::WallTime::now();
  return ros::Time(now.sec, now.nsec);
}

const rig_file::TestRun& chosen_run(const rig_file::RigFile& file, const std::string& name) {
  if (name.empty() && file.test_runs.size() == 1) return file.test_runs.front();
  const rig_file::TestRun& run = rig_file::find_test_run(file.test_runs, name);
  if (run.without_load)
    throw InvalidParameter("run", name, "is for the driver without its load: take it out of mesh by hand");
  return run;
}

}  // namespace

ExciterNode::ExciterNode(const ros::NodeHandle& handle, const ExciterSettings& settings)
    : settings_(settings), handle_(handle), inputs_({settings.file.channels}) {
  command_ = handle_.advertise<std_msgs::Float64>("torque_command", 10);
  ros::NodeHandle states(handle_);
  states.setCallbackQueue(&queue_);
  for (std::size_t i = 0; i < inputs_.topics().size(); ++i) {
    recording_.topics.push_back(handle_.resolveName(inputs_.topics()[i]));
    subscribers_.push_back(states.subscribe<sensor_msgs::JointState>(
        inputs_.topics()[i], 1000, [this, i](const sensor_msgs::JointState::ConstPtr& m) { take(i, *m); },
        ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay()));
  }
  recording_.command_topic = command_.getTopic();
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  states_ = std::make_unique<ros::AsyncSpinner>(1, &queue_);
  states_->start();
  server_ = std::make_unique<Server>(
      ros::NodeHandle("~"), "excite", [this](const auto& goal) { execute(goal); }, false);
  server_->start();
}

ExciterNode::~ExciterNode() {
  stop("the node ends");
  server_->shutdown();
  states_->stop();
}

int ExciterNode::run() {
  ros::AsyncSpinner actions(1);
  actions.start();
  int missed = 0;
  while (signalled == 0 && ros::ok() && missed < kMissed) {
    std::this_thread::sleep_for(kLook);
    missed = ros::master::check() ? 0 : missed + 1;
    if (missed > 0) continue;
    const std::string other = other_publisher();
    if (!other.empty()) stop(other + " publishes on " + command_.getTopic() + " too");
  }
  const std::string why = missed >= kMissed ? "the ROS master is gone" : "the node was asked to end";
  ROS_WARN_STREAM(why);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    refused_ = why;
  }
  stop(why);
  server_->shutdown();  // waits for the thread that commands: zeros are out, the bag is written
  std::this_thread::sleep_for(kLook);  // for the result; roscpp does not report when it is out
  return missed >= kMissed ? kMasterLost : 0;
}

void ExciterNode::stop(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (drive_) drive_->stop(reason);
}

void ExciterNode::take(std::size_t topic, const sensor_msgs::JointState& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!drive_) return;
  recording_.states.push_back({wall_time(), topic, message});
  const auto on_sample = [this](std::size_t, const ros::Time& stamp, const record::ChannelValues& values,
                                const std::string& problem) {
    if (!problem.empty()) return drive_->stop("the state is of no use: " + problem);
    if (first_stamp_.isZero()) first_stamp_ = stamp;
    const auto at = [&values](record::Channel c) { return values[static_cast<std::size_t>(c)]; };
    const double velocity = at(record::Channel::motor_velocity);
    drive_->take(steady_seconds(), (stamp - first_stamp_).toSec(), at(record::Channel::motor_position),
                 std::isnan(velocity) ? std::nullopt : std::optional<double>(velocity));
  };
  inputs_.take(topic, message, on_sample);
}

std::string ExciterNode::other_publisher() const {
  XmlRpc::XmlRpcValue state, answer, arguments;
  arguments[0] = ros::this_node::getName();
  if (!ros::master::execute("getSystemState", arguments, answer, state, false)) return "";
  for (int i = 0; i < state[0].size(); ++i) {  // NOLINT(modernize-loop-convert): begin() is of a struct
    if (static_cast<std::string>(state[0][i][0]) != command_.getTopic()) continue;
    for (int node = 0; node < state[0][i][1].size(); ++node) {
      const std::string name = state[0][i][1][node];
      if (name != ros::this_node::getName()) return name;
    }
  }
  return "";
}

void ExciterNode::refuse_if_not_alone() const {
  const std::string other = other_publisher();
  if (!other.empty())
    throw InvalidParameter("torque_command", command_.getTopic(), "has another publisher: " + other);
  if (command_.getNumSubscribers() == 0)
    throw InvalidParameter("torque_command", command_.getTopic(), "has no subscriber: no controller listens");
  for (const ros::Subscriber& states : subscribers_)
    if (states.getNumPublishers() == 0)
      throw InvalidParameter("joint_states", states.getTopic(), "has no publisher: no state comes");
}

void ExciterNode::command(double torque, Result& result) {
  std_msgs::Float64 message;
  message.data = torque;
  command_.publish(message);
  ++result.commands;
  result.largest_torque = std::max(result.largest_torque, std::abs(torque));
  const std::lock_guard<std::mutex> lock(mutex_);
  recording_.commands.emplace_back(wall_time(), torque);
}

void ExciterNode::send_zeros(Result& result) {
  for (int i = 0; i < kZeros; ++i) {
    command(0, result);
    std::this_thread::sleep_for(kZeroStep);
  }
}

void ExciterNode::command_until_the_end(Result& result) {
  const auto step = std::chrono::duration<double>(1 / settings_.rate);
  const double begin = steady_seconds();
  double next_feedback = begin;
  for (auto due = std::chrono::steady_clock::now();;
       due += std::chrono::duration_cast<std::chrono::nanoseconds>(step)) {
    const double now = steady_seconds();
    double torque = 0, fraction = 0;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (signalled != 0 || !ros::ok()) drive_->stop("the node was asked to end");
      if (server_->isPreemptRequested()) drive_->stop("cancelled");
      torque = drive_->torque(now);
      fraction = drive_->fraction(now);
      if (drive_->ended()) return;
    }
    command(torque, result);
    if (now >= next_feedback) {
      backlash_diagnosis::ExciteFeedback feedback;
      feedback.fraction = fraction;
      feedback.elapsed = now - begin;
      feedback.torque = torque;
      server_->publishFeedback(feedback);
      next_feedback = now + kFeedbackInterval;
    }
    std::this_thread::sleep_until(due);
  }
}

void ExciterNode::drive(const backlash_diagnosis::ExciteGoal& goal, Result& result) {
  const rig_file::TestRun& run = chosen_run(settings_.file, goal.run);
  auto drive = std::make_unique<simulation::SafeDrive>(run.excitation, run.duration, settings_.limits,
                                                       settings_.drive);
  const std::string bag =
      goal.bag.empty() ? "" : FileFolder("~folder", settings_.folder).inside("bag", goal.bag);
  const std::string plan = fmt::format("{}: {} s, up to {:.4g} N m, ramps of {} s", run.name, run.duration,
                                       drive->plan().largest_torque, settings_.drive.ramp);
  if (settings_.dry_run) {
    result.message = "dry run, nothing was commanded. " + plan;
    if (!bag.empty()) write_plan(drive->plan(), bag);
    result.bag = bag;
    result.success = true;
    return;
  }
  refuse_if_not_alone();
  ROS_INFO_STREAM(plan);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!refused_.empty()) throw InvalidParameter("goal", "refused", refused_);
    inputs_ = JointInputs({settings_.file.channels});
    first_stamp_ = ros::Time();
    recording_.states.clear();
    recording_.commands.clear();
    drive_ = std::move(drive);
    drive_->start(steady_seconds());
  }
  try {
    command_until_the_end(result);
  } catch (...) {
    stop("an error in the node");
    send_zeros(result);
    throw;
  }
  send_zeros(result);
  write_bag(bag, result);
  result.message = result.success ? plan : result.message;
}

/// As commands from the time that written records begin at.
void ExciterNode::write_plan(const simulation::DrivePlan& plan, const std::string& path) const {
  RunRecording planned;
  planned.command_topic = recording_.command_topic;
  planned.outcome = "dry run: nothing was commanded";
  for (std::size_t i = 0; i < plan.time.size(); ++i)
    planned.commands.emplace_back(kBagTimeOrigin + ros::Duration(plan.time[i]), plan.torque[i]);
  write_run_bag(planned, path);
}

void ExciterNode::write_bag(const std::string& path, Result& result) {
  const std::lock_guard<std::mutex> lock(mutex_);
  result.success = drive_->done();
  result.message = recording_.outcome = drive_->done() ? "done" : drive_->reason();
  result.states = static_cast<std::uint32_t>(recording_.states.size());
  drive_.reset();
  if (path.empty()) return;
  try {
    write_run_bag(recording_, path);
    result.bag = path;
  } catch (const CannotWrite& error) {
    result.success = false;
    result.message += fmt::format("; {}", error.what());
  }
}

void ExciterNode::execute(const backlash_diagnosis::ExciteGoalConstPtr& goal) {
  Result result;
  try {
    drive(*goal, result);
  } catch (const std::exception& error) {
    result.message = error.what();
  }
  if (!result.success) ROS_WARN_STREAM("excite: " << result.message);
  if (result.success)
    server_->setSucceeded(result, result.message);
  else if (server_->isPreemptRequested())
    server_->setPreempted(result, result.message);
  else
    server_->setAborted(result, result.message);
}

int exciter_main(int argc, char** argv) {
  return node_main(argc, argv, "exciter", exciter_help(), [] {
    const ros::NodeHandle handle, private_handle("~");
    return ExciterNode(handle, read_exciter_settings(private_handle)).run();
  });
}

}  // namespace backlash::ros_bridge
