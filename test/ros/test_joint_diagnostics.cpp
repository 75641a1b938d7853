// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/ros/joint_diagnostics.h"
#include "ros/monitor_support.h"

namespace backlash::ros_bridge {
namespace {

using Status = diagnostic_updater::DiagnosticStatusWrapper;

/// What an updater would publish.
class Tasks : public diagnostic_updater::DiagnosticTaskVector {
 public:
  Status status(const std::string& name) {
    for (const DiagnosticTaskInternal& task : getTasks()) {
      if (task.getName() != name) continue;
      Status status;
      task.run(status);
      return status;
    }
    throw InvalidParameter("status", name, "is not there");
  }
};

std::string value_of(const Status& status, const std::string& key) {
  for (const diagnostic_msgs::KeyValue& value : status.values)
    if (value.key == key) return value.value;
  return "absent";
}

TEST(JointDiagnostics, WarnsWhileEstimatesAreLeftOut) {
  ros::Time::init();
  std::promise<void> allowed;
  const std::shared_future<void> wait = allowed.get_future().share();
  JointMonitor monitor(monitor_settings("elbow"),
                       [&](const ros::Time&, const diagnosis::Diagnosis&) { wait.wait(); });
  DiagnosticsSettings settings;
  settings.stale = 600;  // however slow the machine is
  settings.hold = 0;
  JointDiagnostics diagnostics(monitor, nullptr, "joint_states", settings);
  Tasks tasks;
  diagnostics.add_to(tasks);

  test::RecordRecipe recipe;
  recipe.duration = 4;
  EXPECT_EQ(feed(monitor, test::make_record(recipe)), 38);  // one is computed, eight may wait
  diagnostics.update();
  const Status busy = tasks.status("elbow: input");
  EXPECT_EQ(busy.level, diagnostic_msgs::DiagnosticStatus::WARN);
  EXPECT_EQ(busy.message, "samples come faster than they can be diagnosed: estimates are left out");
  EXPECT_EQ(value_of(busy, "Estimates left out"), std::to_string(monitor.state().replaced));
  EXPECT_GT(monitor.state().replaced, 0);

  // No more since: all is well, and the count stays.
  EXPECT_TRUE(diagnostics.update());
  const Status after = tasks.status("elbow: input");
  EXPECT_EQ(after.level, diagnostic_msgs::DiagnosticStatus::OK);
  EXPECT_EQ(value_of(after, "Estimates left out"), value_of(busy, "Estimates left out"));
  allowed.set_value();
  monitor.stop();
}

// The zero of an encoder that moves while the joint is watched; the commands say the same of the bag.
TEST(JointDiagnostics, SaysWhatIsWrongWithTheRecording) {
  ros::Time::init();
  test::RecordRecipe recipe;
  recipe.noise = 1e-3;
  record::Record spoilt = test::make_record(recipe);
  std::vector<double>& motor = spoilt.column(record::Channel::motor_position);
  for (std::size_t k = motor.size() / 2; k < motor.size(); ++k) motor[k] += 1;  // rad, travel: 0.01
  const record::RecordCheck offline = record::check_record(spoilt).check;
  const auto found = std::find_if(offline.findings.begin(), offline.findings.end(), [](const auto& finding) {
    return finding.kind == record::FindingKind::jump;
  });
  ASSERT_NE(found, offline.findings.end());

  JointMonitor monitor(monitor_settings("elbow"));
  feed(monitor, spoilt);
  DiagnosticsSettings settings;
  settings.stale = 600;
  JointDiagnostics diagnostics(monitor, nullptr, "joint_states", settings);
  Tasks tasks;
  diagnostics.add_to(tasks);
  const Status status = tasks.status("elbow: signal quality");
  EXPECT_EQ(status.level, diagnostic_msgs::DiagnosticStatus::WARN);
  const std::string jump = value_of(status, "jump");
  EXPECT_EQ(jump, found->message);
  EXPECT_NE(status.message.find(jump), std::string::npos) << status.message;
  monitor.stop();
}

}  // namespace
}  // namespace backlash::ros_bridge
