// SPDX-License-Identifier: BSD-3-Clause
// A joint's monitor, fed with a record.
#pragma once

#include <cmath>
#include <string>

#include "backlash_diagnosis/ros/joint_monitor.h"
#include "support/curve.h"
#include "support/records.h"

namespace backlash::ros_bridge {

/// Stamp of a time [s] of a record, to the nanosecond.
inline ros::Time stamp_of(double time) {
  return ros::Time(1'000'000'000, 0) + ros::Duration().fromNSec(std::lround(1e9 * time));
}

inline MonitorSettings monitor_settings(const std::string& joint) {
  MonitorSettings settings;
  settings.joint = joint;
  settings.rig = rig_file::default_rig_file();
  settings.curve = test::linear_curve();
  settings.estimate_interval = 0;  // each period
  return settings;
}

/// All samples of a record; how many of them completed a period.
inline long feed(JointMonitor& monitor, const record::Record& record, std::size_t from = 0) {
  long periods = 0;
  for (std::size_t i = from; i < record.size(); ++i)
    periods +=
        monitor.take(stamp_of(record.time[i]), test::values_at(record, i), "", "joint_states").has_value();
  return periods;
}

}  // namespace backlash::ros_bridge
