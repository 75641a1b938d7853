// SPDX-License-Identifier: BSD-3-Clause
// What the benchmarks of the nodes need beside them: a publisher of joint states and subscribers that do
// nothing.
//
//   messages publish RATE COUNT JOINTS PID   publishes COUNT samples of JOINTS joints on joint_states, RATE
//   [Hz] of
//       them per second of stamps and of wall time (RATE < 0: as fast as they are taken, stamps at -RATE),
//       and prints as JSON the seconds until the subscriber of process PID has handled the last and its CPU
//       seconds until then. Its end is marked by amplitude_distribution (a period is complete) or by
//       bare_done.
//   messages bare COUNT      subscribes with an empty callback; one bare_done when COUNT have come
//   messages latency         subscribes; when stopped prints as JSON how late samples came after their stamps
#include <backlash_diagnosis/AmplitudeDistribution.h>
#include <dirent.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Empty.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/ros/joint_state.h"
#include "backlash_diagnosis/simulation/simulation.h"

namespace {

using namespace backlash;
using Messages = std::vector<sensor_msgs::JointState>;

constexpr int kPeriods = 4, kSettling = 2;
constexpr double kPatience = 120;  // s

/// CPU time [s] of all threads of a process so far.
double cpu_seconds(const std::string& pid) {
  const std::string folder = "/proc/" + pid + "/task";
  double sum = 0;
  DIR* tasks = opendir(folder.c_str());
  if (!tasks) return NAN;
  while (const dirent* task = readdir(tasks)) {
    if (task->d_name[0] == '.') continue;
    double nanoseconds = 0;
    std::ifstream(folder + "/" + task->d_name + "/schedstat") >> nanoseconds;
    sum += nanoseconds * 1e-9;
  }
  closedir(tasks);
  return sum;
}

/// Some settled periods of the built-in rig; all joints move alike.
Messages one_round(double rate, int joints) {
  rig_file::RigFile file = rig_file::default_rig_file();
  file.rig.mesh.backlash = 8e-5;
  file.simulation.sensors.sampling_rate = rate;
  simulation::Simulation simulation(file.rig, file.simulation);
  const long period = std::lround(rate / file.simulation.excitation.frequency);
  Messages round;
  for (long k = 0; k < (kSettling + kPeriods) * period; ++k) {
    const model::Observation seen = simulation.step();
    if (k < kSettling * period) continue;
    round.emplace_back();
    for (int j = 0; j < joints; ++j)
      ros_bridge::add_joint_state(
          seen, ros_bridge::JointNames(joints == 1 ? file.rig.joint : "joint_" + std::to_string(j)),
          round.back());
  }
  return round;
}

int publish(double rate, long count, int joints, const std::string& pid) {
  const bool flood = rate < 0;
  rate = std::fabs(rate);
  Messages round = one_round(rate, joints);
  ros::NodeHandle handle;
  std::atomic<bool> done{false};
  const ros::Time origin = ros::Time::now();
  const ros::Time last = origin + ros::Duration(double(count - 2) / rate);
  const auto of_diagnoser = handle.subscribe<backlash_diagnosis::AmplitudeDistribution>(
      "amplitude_distribution", 1000, [&](const backlash_diagnosis::AmplitudeDistribution::ConstPtr& m) {
        if (m->header.stamp >= last) done = true;
      });
  const auto of_bare = handle.subscribe<std_msgs::Empty>(
      "bare_done", 10, [&](const std_msgs::Empty::ConstPtr&) { done = true; });
  ros::Publisher states = handle.advertise<sensor_msgs::JointState>("joint_states", 0);
  const ros::WallTime patience = ros::WallTime::now() + ros::WallDuration(kPatience);
  while (states.getNumSubscribers() == 0 && ros::WallTime::now() < patience) ros::WallDuration(0.05).sleep();
  ros::AsyncSpinner spinner(1);
  spinner.start();
  const double cpu = cpu_seconds(pid);
  const ros::WallTime start = ros::WallTime::now();
  for (long k = 0; k < count && ros::ok(); ++k) {
    const double due = double(k) / rate, early = due - (ros::WallTime::now() - start).toSec();
    if (!flood && early > 0) ros::WallDuration(early).sleep();
    sensor_msgs::JointState& message = round[std::size_t(k) % round.size()];
    message.header.stamp = origin + ros::Duration(due);
    states.publish(message);
  }
  while (!done && ros::ok() && ros::WallTime::now() < patience) ros::WallDuration(0.001).sleep();
  std::printf("{\"handled\": %s, \"seconds\": %.6f, \"cpu_seconds\": %.6f}\n", done ? "true" : "false",
              (ros::WallTime::now() - start).toSec(), cpu_seconds(pid) - cpu);
  return done ? 0 : 1;
}

int bare(long count) {
  ros::NodeHandle handle;
  ros::Publisher done = handle.advertise<std_msgs::Empty>("bare_done", 10);
  long taken = 0;
  const auto subscriber = handle.subscribe<sensor_msgs::JointState>(
      "joint_states", 0,
      [&](const sensor_msgs::JointState::ConstPtr&) {
        if (++taken == count) done.publish(std_msgs::Empty());
      },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  ros::spin();
  return 0;
}

int latency() {
  ros::NodeHandle handle;
  std::vector<double> late;
  late.reserve(1'000'000);
  const auto subscriber = handle.subscribe<sensor_msgs::JointState>(
      "joint_states", 0,
      [&](const sensor_msgs::JointState::ConstPtr& m) {
        late.push_back((ros::Time::now() - m->header.stamp).toSec());
      },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  ros::spin();
  std::sort(late.begin(), late.end());
  const auto at = [&](double share) {
    return late.empty() ? NAN : 1e3 * late[std::size_t(share * double(late.size() - 1))];
  };
  std::printf("{\"samples\": %zu, \"median_ms\": %.3f, \"p999_ms\": %.3f, \"worst_ms\": %.3f}\n", late.size(),
              at(0.5), at(0.999), at(1));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "benchmark", ros::init_options::AnonymousName);
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 5 && words[0] == "publish")
    return publish(std::stod(words[1]), std::stol(words[2]), std::stoi(words[3]), words[4]);
  if (words.size() == 2 && words[0] == "bare") return bare(std::stol(words[1]));
  if (words.size() == 1 && words[0] == "latency") return latency();
  std::fprintf(stderr, "usage: see the first lines of benchmark/messages.cpp\n");
  return 64;
}
