// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace backlash::ros_bridge
