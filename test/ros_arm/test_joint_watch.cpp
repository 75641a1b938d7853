// SPDX-License-Identifier: BSD-3-Clause
// A joint under watch, fed with the torque that the test writes down: inverse dynamics of one inertia with
// gravity and friction along sums of sines, with white noise. Each look runs detect_changes as the node does.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <set>
#include <utility>

#include "arm/arm_machines.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/report/change_file.h"
#include "backlash_diagnosis/ros/arm/change_watch_node.h"
#include "backlash_diagnosis/ros/arm/joint_watch.h"

namespace backlash::ros_bridge {
namespace {

constexpr double kRate = 100;                    // Hz
constexpr double kNoise = 0.03;                  // N m
constexpr std::uint32_t kStart = 1'700'000'000;  // s since 1970

/// A joint that publishes its motion.
struct Robot {
  JointWatch watch;
  std::mt19937 random{7};
  double time = 0;                                // s of motion; stands still while the joint rests
  double stamp = 0;                               // s since kStart
  double friction = 0, swing = 0;                 // N m, added; the second as no effect does
  double position_glitch = 0, torque_glitch = 0;  // rad and N m, of the next sample
  std::vector<diagnosis::KnownChange> news;

  explicit Robot(WatchSettings settings) : watch(std::move(settings)) {}

  void publish(double position, double torque) {
    record::ChannelValues values;
    values.fill(kNaN);
    values[static_cast<std::size_t>(record::Channel::motor_position)] = position;
    values[static_cast<std::size_t>(record::Channel::motor_torque)] = torque;
    const ros::Time at = ros::Time(kStart, 0) + ros::Duration().fromNSec(std::lround(1e9 * stamp));
    if (watch.take(at, values, "", "joint_states"))
      for (const auto& change : watch.look(nullptr)) news.push_back(change);
    stamp += 1 / kRate;
  }

  /// One sample of the motion at `pace` (and its rate of change [1/s]) of its usual speed.
  void sample(double pace, double rate, bool lost) {
    std::normal_distribution<double> noise(0, kNoise);
    const double f[] = {0.11, 0.17, 0.29}, a[] = {0.8, 0.6, 0.3};
    double q = 0, w = 0, acceleration = 0;
    for (int i = 0; i < 3; ++i) {
      const double o = 2 * M_PI * f[i];
      q += a[i] * std::sin(o * time);
      w += pace * a[i] * o * std::cos(o * time);
      acceleration += a[i] * o * (rate * std::cos(o * time) - pace * pace * o * std::sin(o * time));
    }
    const double dry = pace > 0 ? std::copysign(0.75 + friction, w) : 0;
    const double torque =
        0.45 * acceleration + 1.1 * w + dry + 3 * std::sin(q) + swing * std::sin(3 * stamp) + noise(random);
    time += pace / kRate;
    if (lost)
      stamp += 1 / kRate;
    else
      publish(q + std::exchange(position_glitch, 0), torque + std::exchange(torque_glitch, 0));
  }

  void move(double duration, double lost = 0) {
    std::uniform_real_distribution<double> chance(0, 1);
    for (int k = 0; k < int(duration * kRate); ++k) sample(1, 0, chance(random) < lost);
  }

  /// Comes to rest within a second, rests, and goes on.
  void rest(double duration) {
    for (int k = 0; k < int(kRate); ++k)
      sample(0.5 + 0.5 * std::cos(M_PI * k / kRate), -0.5 * M_PI * std::sin(M_PI * k / kRate), false);
    for (int k = 0; k < int(duration * kRate); ++k) sample(0, 0, false);
    for (int k = 0; k < int(kRate); ++k)
      sample(0.5 - 0.5 * std::cos(M_PI * k / kRate), 0.5 * M_PI * std::sin(M_PI * k / kRate), false);
  }
};

WatchSettings settings(const ScratchFolder& folder) {
  WatchSettings s;
  s.joint.joint = "joint";
  s.joint.rig = rig_file::load_rig_file(BACKLASH_DIAGNOSIS_SOURCE_DIR "/config/ur10e_joint.yaml");
  s.learned = folder.path("joint_healthy.csv");
  s.log = folder.path("joint_changes.csv");
  s.learn = 120;
  s.window = 120;
  s.check_interval = 30;
  return s;
}

TEST(JointWatch, LearnsThenReportsAChangeAndRemembersIt) {
  const ScratchFolder folder;
  Robot robot(settings(folder));
  EXPECT_NE(robot.watch.state().why_not.find("being learned, 0 of 120 s"), std::string::npos);
  robot.move(240);
  EXPECT_TRUE(std::filesystem::exists(folder.path("joint_healthy.csv")));
  EXPECT_GE(robot.watch.state().judged, 2);
  EXPECT_TRUE(robot.watch.state().why_not.empty()) << robot.watch.state().why_not;
  EXPECT_TRUE(robot.news.empty());
  const double since = kStart + robot.stamp;
  robot.friction = 0.2;
  robot.move(95);
  ASSERT_FALSE(robot.news.empty());
  EXPECT_EQ(robot.news[0].found.effect, "motor_coulomb");
  EXPECT_LE(robot.news[0].found.since_from, since);
  EXPECT_GE(robot.news[0].found.since_to, since);
  // A node that starts again knows the machine and what was reported.
  Robot again(settings(folder));
  ASSERT_EQ(again.watch.state().changes.size(), 1u);
  EXPECT_EQ(again.watch.state().changes[0].state, diagnosis::ChangeState::standing);
  EXPECT_EQ(again.watch.state().healthy, folder.path("joint_healthy.csv"));
}

TEST(JointWatch, PausesJumpsAndLostMessagesAreNoChange) {
  const ScratchFolder folder;
  Robot robot(settings(folder));
  robot.move(150);
  robot.rest(60);
  robot.move(90);
  robot.stamp += 200;  // nothing is published
  robot.move(40, 0.3);
  robot.position_glitch = 1;  // single readings that are wrong
  robot.move(25);
  robot.torque_glitch = -40;
  robot.move(25);
  robot.stamp += 4000;  // longer than a rest may be
  robot.move(90);
  robot.stamp -= 4500;  // a bag that begins again
  robot.move(90);
  for (const auto& change : robot.news) ADD_FAILURE() << report::change_text(change.found);
  EXPECT_EQ(robot.watch.state().counters.restarts, 2);
  EXPECT_GE(robot.watch.state().judged, 5);
  EXPECT_TRUE(robot.watch.state().different.empty());
}

TEST(JointWatch, SaysWhyThereIsNoAnswer) {
  const ScratchFolder folder;
  Robot at_rest(settings(folder));
  at_rest.rest(160);
  EXPECT_NE(at_rest.watch.state().why_not.find("moves"), std::string::npos) << at_rest.watch.state().why_not;
  EXPECT_FALSE(std::filesystem::exists(folder.path("joint_healthy.csv")));
  // What changes while it is learned is not learned.
  Robot changing(settings(folder));
  changing.move(60);
  changing.friction = 0.3;
  changing.move(61);
  EXPECT_NE(changing.watch.state().why_not.find("change within themselves: motor_coulomb"), std::string::npos)
      << changing.watch.state().why_not;
  EXPECT_FALSE(std::filesystem::exists(folder.path("joint_healthy.csv")));
  // Nor is what follows no effect a healthy machine.
  Robot healthy(settings(folder));
  healthy.move(121);
  ASSERT_TRUE(std::filesystem::exists(folder.path("joint_healthy.csv")));
  Robot odd(settings(folder));
  odd.swing = 0.3;
  odd.move(95);
  EXPECT_TRUE(odd.news.empty());
  EXPECT_NE(odd.watch.state().why_not.find("from its beginning the record follows no effect"),
            std::string::npos)
      << odd.watch.state().why_not;
  WatchSettings sensor = settings(folder);
  sensor.joint.rig = rig_file::default_rig_file();
  sensor.learned = folder.path("sensor_healthy.csv");
  EXPECT_NE(Robot(sensor).watch.state().why_not.find("being learned"), std::string::npos);
  WatchSettings locked = settings(folder);
  locked.joint.rig = rig_file::load_rig_file(BACKLASH_DIAGNOSIS_SOURCE_DIR "/config/cycloidal.yaml");
  EXPECT_NE(Robot(locked).watch.state().why_not.find("declares neither"), std::string::npos);
  WatchSettings missing = settings(folder);
  missing.healthy = {"/nowhere/monday.csv"};
  EXPECT_THROW(JointWatch{missing}, MissingInput);
}

/// An arm's record as messages, each joint one sample of a stamp.
void play(const arm::ArmRecord& record, record::Channel channel, double start, JointWatch& watch,
          std::vector<diagnosis::KnownChange>& news) {
  for (std::size_t k = 0; k < record.joints.front().size(); ++k) {
    bool due = false;
    for (std::size_t j = 0; j < record.joints.size(); ++j) {
      const record::Record& joint = record.joints[j];
      record::ChannelValues values;
      values.fill(kNaN);
      for (const record::Channel c :
           {channel, record::Channel::motor_position, record::Channel::motor_velocity})
        values[static_cast<std::size_t>(c)] = joint.column(c)[k];
      due = watch.take(ros::Time(kStart + start + joint.time[k]), values, "", "/joint_states", j) || due;
    }
    if (!due) continue;
    for (const diagnosis::KnownChange& change : watch.look(nullptr)) news.push_back(change);
  }
}

// Two joints of the same arm change at once: each is reported of its own joint.
TEST(JointWatch, AnArmIsWatchedAsOneMachine) {
  const ScratchFolder folder;
  const test::Machine machine(4);
  test::Machine worn = machine;
  worn.drives[2].terms[std::size_t(arm::DriveTerm::coulomb)] *= 1.4;
  worn.drives[3].terms[std::size_t(arm::DriveTerm::coulomb)] *= 1.4;
  WatchSettings s;
  s.arm = machine.declared;
  s.joint.joint = machine.declared.name;
  for (const std::string& joint : machine.declared.joint_names())
    s.arm_joints.push_back(robot_channels(joint, machine.declared.channel));
  s.learned = folder.path("arm_healthy.csv");
  s.log = folder.path("arm_changes.csv");
  s.learn = s.window = 60;
  s.check_interval = 15;
  JointWatch watch(s);
  std::vector<diagnosis::KnownChange> news;
  play(machine.record(41, 62), machine.declared.channel, 0, watch, news);
  EXPECT_TRUE(std::filesystem::exists(s.learned)) << watch.state().why_not;
  EXPECT_TRUE(news.empty());
  play(machine.record(42, 75, worn, 25), machine.declared.channel, 62, watch, news);
  std::set<std::string> reported;
  for (const diagnosis::KnownChange& change : watch.state().changes) {
    reported.insert(change.found.joint + " " + change.found.effect);
    EXPECT_LE(change.found.since_from, kStart + 87);
    EXPECT_GE(change.found.since_to, kStart + 87);
  }
  EXPECT_EQ(reported, (std::set<std::string>{"elbow_joint motor_coulomb", "wrist_1_joint motor_coulomb"}))
      << watch.state().why_not;
  const std::vector<diagnosis::KnownChange> restored = JointWatch(s).state().changes;
  ASSERT_EQ(restored.size(), 2U);
  EXPECT_EQ(restored[0].found.joint, watch.state().changes[0].found.joint);
}

TEST(ChangeWatch, RateIsReadAsItIsSaid) {
  EXPECT_DOUBLE_EQ(false_alarm_rate("1 per month"), 1.0 / 720);
  EXPECT_DOUBLE_EQ(false_alarm_rate("0.5 per day"), 0.5 / 24);
  EXPECT_DOUBLE_EQ(false_alarm_rate("2 per year"), 2.0 / 8760);
  for (const char* wrong :
       {"", "1", "1 per", "1 per moon", "0 per day", "-1 per day", "x per day", "per day"})
    EXPECT_THROW(false_alarm_rate(wrong), InvalidParameter) << wrong;
}

}  // namespace
}  // namespace backlash::ros_bridge
