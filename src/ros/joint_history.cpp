// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/joint_history.h"

#include <ros/console.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "backlash_diagnosis/base/error.h"

namespace backlash::ros_bridge {
namespace {

constexpr std::size_t kMostWaiting = 100'000;  // entries: two months of a minute each
constexpr std::size_t kMostPoints = 100'000;   // of the trend, which finds medians of far fewer stretches

/// Every second one; the trend does not see the difference.
void thin(std::vector<diagnosis::TrendPoint>& points) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points.size(); i += 2) points[kept++] = points[i];
  points.resize(kept);
}

}  // namespace

JointHistory::JointHistory(const Settings& settings)
    : settings_(settings), history_(diagnosis::History::Settings{settings.path}) {
  state_.path = settings.path;
  const diagnosis::HistoryFile file = diagnosis::read_history(settings.path);
  for (const std::string& warning : file.warnings) ROS_WARN("%s", warning.c_str());
  for (const diagnosis::HistoryEntry& entry : file.entries)
    last_ = std::max(last_.value_or(entry.time), entry.time);
  add_points(file.entries);
}

void JointHistory::take(double stamp, const diagnosis::Diagnosis& diagnosis) {
  const std::lock_guard<std::mutex> lock(mutex_);
  state_.behind = last_ && stamp < *last_ - settings_.interval;
  if (state_.behind) {
    ++state_.left_out;
    return;
  }
  // Stamps are seconds since 1970 as doubles, with a resolution of about a microsecond.
  if (last_ && stamp < *last_ + settings_.interval - 1e-6) return;
  add(diagnosis::history_entry(stamp, diagnosis, settings_.rig_digest));
}

void JointHistory::take_baseline(double stamp, const diagnosis::Diagnosis& diagnosis) {
  const std::lock_guard<std::mutex> lock(mutex_);
  diagnosis::HistoryEntry entry = diagnosis::history_entry(stamp, diagnosis, settings_.rig_digest);
  entry.event = diagnosis::kBaselineEvent;
  add(std::move(entry));
}

/// Called with the lock held.
void JointHistory::add(diagnosis::HistoryEntry entry) {
  last_ = std::max(last_.value_or(entry.time), entry.time);
  if (waiting_.size() >= kMostWaiting) {
    waiting_.pop_front();
    ++state_.lost;
  }
  waiting_.push_back(std::move(entry));
}

void JointHistory::add_points(const std::vector<diagnosis::HistoryEntry>& entries) {
  const auto baseline = std::find_if(
      entries.rbegin(), entries.rend(),
      [](const diagnosis::HistoryEntry& entry) { return entry.event == diagnosis::kBaselineEvent; });
  if (baseline != entries.rend()) points_.clear();
  const auto fresh = diagnosis::trend_points(entries, settings_.angular, settings_.rig_digest);
  points_.insert(points_.end(), fresh.begin(), fresh.end());
  while (points_.size() > kMostPoints) thin(points_);
  stale_trend_ = true;
}

void JointHistory::flush(std::optional<double> limit) {
  std::vector<diagnosis::HistoryEntry> written;
  std::string problem;
  for (;;) {
    diagnosis::HistoryEntry entry;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (waiting_.empty()) break;
      entry = waiting_.front();
    }
    try {
      history_.append(entry);
    } catch (const Error& error) {
      problem = error.what();
      break;
    }
    written.push_back(std::move(entry));
    const std::lock_guard<std::mutex> lock(mutex_);
    waiting_.pop_front();
  }
  if (!written.empty()) add_points(written);
  std::optional<diagnosis::Trend> trend;
  if (stale_trend_ || limit != limit_) trend = diagnosis::find_trend(points_, limit, settings_.angular);
  stale_trend_ = false;
  limit_ = limit;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!problem.empty() && problem != state_.problem) ROS_ERROR("history: %s", problem.c_str());
  state_.problem = problem;
  state_.entries += long(written.size());
  if (trend) state_.trend = *trend;
}

JointHistory::State JointHistory::state() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  State state = state_;
  state.waiting = long(waiting_.size());
  return state;
}

}  // namespace backlash::ros_bridge
