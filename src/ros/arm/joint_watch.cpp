// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/arm/joint_watch.h"

#include <fmt/format.h>
#include <ros/console.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/change_log.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/report/change_file.h"

namespace backlash::ros_bridge {
namespace {

constexpr double kLeastLook = 60;  // s of samples, below which nobody looks. Choice: twice what can be judged
constexpr double kAll = 0.99;      // - of a length that is all of it: samples come in steps
constexpr int kNone = 0, kSome = 2;  // exit codes of the command that are answers

bool has(const record::ChannelMap& map, record::Channel channel) {
  return std::any_of(map.sources.begin(), map.sources.end(),
                     [&](const record::ChannelSource& s) { return s.channel == channel; });
}

/// A torque sensor before the gear, with which the whole motion is fitted.
bool has_sensor(const JointRig& joint) {
  const model::Rig& rig = joint.rig.rig;
  return !rig.mesh.rigid && !model::has_two_inertias(rig) && joint.rig.diagnosis.waveform;
}

record::RingSettings ring_settings(const WatchSettings& settings) {
  record::RingSettings ring;
  ring.window = settings.learn;
  if (settings.arm) {
    ring.channels = {settings.arm->channel, record::Channel::motor_position};
    const auto& joints = settings.arm_joints;
    if (std::all_of(joints.begin(), joints.end(),
                    [](const auto& joint) { return has(joint, record::Channel::load_position); }))
      ring.channels.push_back(record::Channel::load_position);
    return ring;
  }
  ring.channels = {record::Channel::motor_torque, record::Channel::motor_position};
  const bool rigid = settings.joint.rig.rig.mesh.rigid;
  if (has_sensor(settings.joint))
    ring.channels.push_back(record::Channel::sensor_torque);
  else if (!rigid && has(settings.joint.channels(), record::Channel::load_position))
    ring.channels.push_back(record::Channel::load_position);
  return ring;
}

/// Why no look at such a joint has an answer; empty: it may have one.
std::string reason_against(const JointRig& joint) {
  const model::Rig& rig = joint.rig.rig;
  if (!rig.mesh.rigid && !model::has_two_inertias(rig) && !has_sensor(joint))
    return "the rig file declares neither one inertia (mesh: rigid) nor two (rigid couplings, a free link) "
           "nor "
           "a pinion with a torque sensor (an elastic input_coupling): changes are found of these only";
  std::vector<record::Channel> needed = {record::Channel::motor_torque, record::Channel::motor_position};
  if (has_sensor(joint)) needed.push_back(record::Channel::sensor_torque);
  for (const record::Channel wanted : needed)
    if (!has(joint.channels(), wanted)) return "its channels have no " + record::channel_name(wanted);
  return "";
}

double since_1970(const ros::Time& stamp) {
  return stamp.toSec();
}

}  // namespace

JointWatch::JointWatch(WatchSettings settings)
    : settings_(std::move(settings)),
      rings_(settings_.channels().size(), record::SampleRing(ring_settings(settings_))),
      healthy_(settings_.healthy),
      impossible_(settings_.arm ? "" : reason_against(settings_.joint)) {
  for (const std::string& path : healthy_)
    if (!std::filesystem::exists(path))
      throw MissingInput("~healthy: " + path + ": cannot be opened: No such file or directory");
  if (healthy_.empty() && std::filesystem::exists(settings_.learned)) healthy_ = {settings_.learned};
  for (record::SampleRing& ring : rings_) ring.set_window(look_length());
  if (!settings_.log.empty()) ledger_.restore(diagnosis::read_change_log(settings_.log));
}

bool JointWatch::take(const ros::Time& stamp, const record::ChannelValues& values, const std::string& problem,
                      const std::string& topic, std::size_t joint) {
  const std::lock_guard<std::mutex> lock(mutex_);
  state_.last_arrival = ros::WallTime::now();
  if (!problem.empty() || stamp.isZero()) {
    ++state_.bad_messages;
    state_.last_problem = BadData(topic, stamp.isZero() ? "the header stamp is zero" : problem).what();
    return false;
  }
  const double time = clock_.seconds(stamp);
  const record::SampleRing& first = rings_.front();
  const long run = first.counters().restarts;
  if (!rings_[joint].add(time, values) || joint > 0) return false;
  state_.any_sample = true;
  if (first.counters().restarts != run) {
    ledger_.restart();
    next_.reset();
    due_ = false;
  }
  if (!impossible_.empty()) return false;
  if (!next_) next_ = time + std::min(settings_.check_interval, look_length());
  if (time < *next_) return false;
  const double enough =
      healthy_.empty() ? kAll * settings_.learn : std::min(kLeastLook, kAll * settings_.window);
  if (first.length() < enough) return false;
  // One look for each interval at most: that is what the rate of false alarms counts on.
  next_ = time + settings_.check_interval;
  if (due_ || looking_) {
    ++state_.left_out;
    return false;
  }
  return due_ = true;
}

std::optional<JointWatch::Task> JointWatch::begin_look() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!due_) return std::nullopt;
  due_ = false;
  looking_ = true;
  Task task;
  task.run = rings_.front().counters().restarts;
  task.joints = kept();
  if (task.joints.front().record.size() == 0) return task;
  // The record's own time begins at 0, its name for 0 is the stamp of the first sample.
  const double first = task.joints.front().record.time.front();
  task.origin = since_1970(clock_.stamp(first));
  for (record::JointRecord& j : task.joints)
    for (double& t : j.record.time) t -= first;
  task.healthy = healthy_;
  return task;
}

/// Samples of the stamps that all joints have.
std::vector<record::JointRecord> JointWatch::kept() const {
  std::vector<record::JointRecord> joints;
  for (std::size_t j = 0; j < rings_.size(); ++j)
    joints.push_back({settings_.arm ? settings_.arm->joints[j].name : joint(),
                      rings_[j].empty() ? record::Record() : rings_[j].kept()});
  std::vector<double> times = joints.front().record.time;
  for (const record::JointRecord& j : joints) {
    std::vector<double> both;
    std::set_intersection(times.begin(), times.end(), j.record.time.begin(), j.record.time.end(),
                          std::back_inserter(both));
    times = std::move(both);
  }
  for (record::JointRecord& j : joints)
    if (j.record.size() != times.size()) j.record = record::samples_at(j.record, times);
  return joints;
}

void JointWatch::write(const std::vector<record::JointRecord>& joints, const std::string& path) const {
  if (settings_.arm)
    record::write_joints_csv(joints, path);
  else
    record::write_csv(joints.front().record, path);
}

diagnosis::ChangeLook JointWatch::found(const Task& task, const Progress& go_on) const {
  const ScratchFolder scratch;
  const std::string record = scratch.path("newest.csv"), json = scratch.path("changes.json");
  write(task.joints, record);
  Job job;
  job.words = {command_path("detect_changes"), "--rig",
               settings_.arm ? settings_.arm->source : file_of(settings_.joint.rig, scratch), "--healthy"};
  job.words.insert(job.words.end(), task.healthy.begin(), task.healthy.end());
  job.words.insert(job.words.end(),
                   {"--false-alarms-per-hour", to_text(settings_.rate), "--json", json, record});
  job.done = {kNone, kSome};
  job.memory = settings_.job_memory;
  job.progress = go_on;
  run_job(job);
  diagnosis::ChangeLook look = report::read_changes(json, task.origin, settings_.arm.has_value());
  look.from = task.origin;
  look.to = task.origin + task.length();
  return look;
}

std::vector<diagnosis::KnownChange> JointWatch::look(const Progress& go_on) {
  const std::optional<Task> task = begin_look();
  if (!task) return {};
  std::vector<diagnosis::KnownChange> news;
  try {
    if (task->joints.front().record.size() == 0)
      throw CannotIdentify("no stamp has samples of all joints: they must come in one message");
    if (task->healthy.empty())
      learn(*task, go_on);
    else
      news = judge(*task, found(*task, go_on));
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    cannot_tell(error.what());
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  ++state_.looks;
  looking_ = false;
  return news;
}

void JointWatch::cannot_tell(const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  state_.why_not = why;
}

/// Takes the record for the healthy machine, unless something changes in it: either half of it, taken for
/// healthy, must find nothing in the whole. The whole by itself would take a change for a scatter of its
/// values.
void JointWatch::learn(const Task& task, const Progress& go_on) {
  const double middle = task.length() / 2;
  for (const auto& [from, to] : {std::pair(0.0, middle), std::pair(middle, 2 * middle)}) {
    const ScratchFolder scratch;
    Task half = task;
    half.healthy = {scratch.path("half_of_what_is_learned.csv")};
    std::vector<record::JointRecord> part = task.joints;
    for (record::JointRecord& j : part) j.record = j.record.slice(from, to);
    write(part, half.healthy.front());
    const diagnosis::ChangeLook look = found(half, go_on);
    if (look.changes.empty()) continue;
    cannot_tell("the samples to learn the healthy machine from change within themselves: " +
                report::change_text(look.changes.front()));
    return;
  }
  write(task.joints, settings_.learned);
  const std::lock_guard<std::mutex> lock(mutex_);
  healthy_ = {settings_.learned};
  for (record::SampleRing& ring : rings_) ring.set_window(look_length());
  state_.why_not.clear();
  ROS_INFO("%s: the healthy machine is learned, from %.0f s of samples: %s", joint().c_str(), task.length(),
           settings_.learned.c_str());
}

std::vector<diagnosis::KnownChange> JointWatch::judge(const Task& task, const diagnosis::ChangeLook& look) {
  std::vector<diagnosis::KnownChange> news;
  bool differs = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    // Of another run of the clock: its times mean nothing any more.
    if (rings_.front().counters().restarts != task.run) return {};
    ++state_.judged;
    state_.why_not.clear();
    state_.from = look.from;
    state_.to = look.to;
    state_.windows = look.windows;
    state_.unjudged = look.unjudged;
    differs = ledger_.unexplained_difference().empty();
    for (const long id : ledger_.take(look)) news.push_back(ledger_.change(id));
    differs = differs && !ledger_.unexplained_difference().empty();
  }
  if (news.empty() && !differs) return news;
  std::string problem;
  try {
    if (!settings_.log.empty())
      for (const diagnosis::KnownChange& change : news) diagnosis::append_change(settings_.log, change);
    write(task.joints, settings_.changed);
  } catch (const Error& error) {
    problem = error.what();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  state_.log_problem = problem;
  return news;
}

WatchState JointWatch::state() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  WatchState state = state_;
  state.counters = rings_.front().counters();
  state.healthy = joined(healthy_);
  state.learning = rings_.front().length();
  state.changes = ledger_.reported();
  state.different = ledger_.unexplained_difference();
  if (!impossible_.empty())
    state.why_not = impossible_;
  else if (healthy_.empty() && rings_.front().length() < kAll * settings_.learn)
    state.why_not = fmt::format("the healthy machine is being learned, {:.0f} of {:.0f} s so far",
                                rings_.front().length(), settings_.learn) +
                    (state.why_not.empty() ? "" : "; last: " + state.why_not);
  else if (state.why_not.empty() && state.judged == 0)
    state.why_not =
        fmt::format("nothing was looked at yet: {:.0f} s of samples so far, the first look needs {:.0f} s",
                    rings_.front().length(), std::min(kLeastLook, kAll * settings_.window));
  return state;
}

}  // namespace backlash::ros_bridge
