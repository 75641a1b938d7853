// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <future>
#include <mutex>
#include <thread>
#include <vector>

#include "ros/monitor_support.h"
#include "support/curve.h"
#include "support/records.h"

namespace backlash::ros_bridge {
namespace {

using test::make_record;
using test::values_at;

/// What a monitor reports, in the order in which it does.
struct Heard {
  std::mutex mutex;
  std::vector<ros::Time> stamps;
  std::vector<diagnosis::Diagnosis> diagnoses;

  JointMonitor::OnDiagnosis listener() {
    return [this](const ros::Time& stamp, const diagnosis::Diagnosis& diagnosis) {
      const std::lock_guard<std::mutex> lock(mutex);
      stamps.push_back(stamp);
      diagnoses.push_back(diagnosis);
    };
  }
  std::size_t count() {
    const std::lock_guard<std::mutex> lock(mutex);
    return stamps.size();
  }
};

class JointMonitorTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { ros::Time::init(); }
};

TEST_F(JointMonitorTest, EachPeriodHasItsEstimateAndItIsThatOfItsSamples) {
  Heard heard;
  JointMonitor monitor(monitor_settings("elbow"), heard.listener());
  const record::Record record = make_record({});
  std::vector<diagnosis::Diagnosis> expected;
  for (std::size_t end = 300; end <= record.size(); end += 100) {  // two of 15 periods settle
    EXPECT_EQ(feed(monitor, record.slice(0, record.time[end - 1] + 1e-4), end - 100 - (end == 300 ? 200 : 0)),
              1);
    while (heard.count() < expected.size() + 1) std::this_thread::yield();
    const std::size_t begin = end - 100 * std::min<std::size_t>(5, (end - 200) / 100);
    const diagnosis::MonitoringCurve curve = test::linear_curve();
    diagnosis::DiagnosisSettings settings = rig_file::default_rig_file().diagnosis;
    settings.apd->settling_periods = 0;
    expected.push_back(diagnosis::diagnose(
        record.slice(record.time[begin] - 1e-4, record.time[end - 1] + 1e-4), settings, &curve));
    EXPECT_EQ(heard.stamps.back(), stamp_of(record.time[end - 1]));
  }
  monitor.stop();
  ASSERT_EQ(heard.diagnoses.size(), 13u);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(heard.diagnoses[i].verdict.message, expected[i].verdict.message) << i;
    EXPECT_EQ(heard.diagnoses[i].apd->skewness, expected[i].apd->skewness) << i;
  }
  EXPECT_EQ(monitor.state().replaced, 0);
}

// One joint's listener does not return: samples of both joints are taken and the other joint is diagnosed.
TEST_F(JointMonitorTest, ASlowJointDelaysNobody) {
  std::promise<void> allowed;
  const std::shared_future<void> wait = allowed.get_future().share();
  std::vector<ros::Time> reported;
  JointMonitor slow(monitor_settings("slow"), [&](const ros::Time& stamp, const diagnosis::Diagnosis&) {
    reported.push_back(stamp);
    wait.wait();
  });
  Heard heard;
  JointMonitor quick(monitor_settings("quick"), heard.listener());
  test::RecordRecipe recipe;
  recipe.duration = 4;
  const record::Record record = make_record(recipe);
  long periods = 0, quick_periods = 0;
  for (std::size_t i = 0; i < record.size(); ++i) {
    const ros::Time stamp = stamp_of(record.time[i]);
    periods += slow.take(stamp, values_at(record, i), "", "joint_states").has_value();
    if (!quick.take(stamp, values_at(record, i), "", "joint_states")) continue;
    ++quick_periods;
    while (heard.count() < static_cast<std::size_t>(quick_periods)) std::this_thread::yield();
  }
  EXPECT_EQ(periods, 38);
  EXPECT_EQ(heard.count(), 38u);
  EXPECT_EQ(quick.state().replaced, 0);
  EXPECT_EQ(slow.state().counters.accepted, 4000);
  std::string note;
  ros::Time stamp;
  EXPECT_FALSE(slow.diagnose(10, 0, note, stamp).estimates.empty());  // the service answers as well
  EXPECT_EQ(note, "");
  allowed.set_value();
  slow.stop();
  EXPECT_GT(slow.state().replaced, 0);
  // What came last is reported, and every estimate was reported or counted.
  EXPECT_EQ(reported.back(), stamp_of(record.time.back()));
  EXPECT_EQ(static_cast<long>(reported.size()) + slow.state().replaced, periods);
  EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
}

/// `first` s of one travel, then `second` s of another.
record::Record changing(double first, double before, double second, double after) {
  test::RecordRecipe recipe;
  recipe.noise = 1e-3;
  recipe.duration = first;
  recipe.travel = before;
  record::Record record = make_record(recipe);
  recipe.duration = second;
  recipe.travel = after;
  recipe.start = first;
  const record::Record more = make_record(recipe);
  record.time.insert(record.time.end(), more.time.begin(), more.time.end());
  for (const record::Channel channel : record::kChannels)
    if (record.has(channel))
      record.column(channel).insert(record.column(channel).end(), more.column(channel).begin(),
                                    more.column(channel).end());
  return record;
}

// A baseline is of one play; else it says when it became another.
TEST_F(JointMonitorTest, SaysWhenThePlayChanged) {
  JointMonitor one(monitor_settings("elbow"));
  feed(one, changing(12, 0.0100, 3, 0.0104));  // 4 % are no change
  EXPECT_EQ(one.change_of_play(), "");
  JointMonitor two(monitor_settings("elbow"));
  feed(two, changing(12, 0.0100, 3, 0.0050));
  const std::string text = two.change_of_play();
  // Stamps begin at 1e9 s, 2001-09-09T01:46:40Z; twelve stretches of 1.25 s, of which one holds both.
  int from = 0, to = 0;
  const char* const kFormat = "the play changed between 2001-09-09T01:46:%dZ and 2001-09-09T01:46:%dZ";
  ASSERT_EQ(std::sscanf(text.c_str(), kFormat, &from, &to), 2) << text;
  EXPECT_LE(from, 52);
  EXPECT_GE(to + 1, 52);  // shown without its fraction
  EXPECT_LE(to - from, 5);
  EXPECT_NE(text.find("lost_motion"), std::string::npos) << text;
}

// No sample: at once, whatever the timeout.
TEST_F(JointMonitorTest, NobodyWaitsForARobotThatIsNotThere) {
  MonitorSettings settings = monitor_settings("elbow");
  settings.silent = 0.2;
  JointMonitor monitor(settings);
  std::string note;
  ros::Time stamp;
  EXPECT_TRUE(monitor.diagnose(10, 1e6, note, stamp).estimates.empty());
}

// Services ask and settings change while samples come; the sanitizers watch.
TEST_F(JointMonitorTest, SnapshotsUnderConcurrency) {
  Heard heard;
  JointMonitor monitor(monitor_settings("elbow"), heard.listener());
  test::RecordRecipe recipe;
  recipe.duration = 6;
  const record::Record record = make_record(recipe);
  std::promise<void> fed;
  const auto done = fed.get_future().share();
  const auto busy = [&done] { return done.wait_for(std::chrono::seconds(0)) != std::future_status::ready; };
  std::thread asking([&] {
    while (busy()) {
      std::string note;
      ros::Time stamp;
      const diagnosis::Diagnosis diagnosis = monitor.diagnose(3, 0, note, stamp);
      if (note.empty()) EXPECT_EQ(diagnosis.apd->periods.size(), 3u);
    }
  });
  std::thread changing([&] {
    for (int i = 1; busy(); i = i % 7 + 1) {
      monitor.set_window(i, 0);
      monitor.set_limits(std::nullopt);
      EXPECT_GE(monitor.state().replaced, 0);
    }
  });
  EXPECT_EQ(feed(monitor, record), 58);
  fed.set_value();
  asking.join();
  changing.join();
  monitor.stop();
  EXPECT_GT(heard.count(), 0u);
  for (const diagnosis::Diagnosis& diagnosis : heard.diagnoses) {
    EXPECT_GE(diagnosis.apd->periods.size(), 1u);
    EXPECT_LE(diagnosis.apd->periods.size(), 7u);
  }
}

}  // namespace
}  // namespace backlash::ros_bridge
