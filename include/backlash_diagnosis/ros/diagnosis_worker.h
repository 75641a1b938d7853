// SPDX-License-Identifier: BSD-3-Clause
// Diagnoses of one joint, computed in a thread of their own: a joint whose diagnosis takes long delays
// neither the subscriber nor another joint.
#pragma once

#include <ros/time.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "backlash_diagnosis/diagnosis/earlier_answer.h"

namespace backlash::ros_bridge {

/// What a diagnosis needs, as it was when the last sample of the window came. Nothing of it is shared with
/// the stream.
struct DiagnosisTask {
  ros::Time stamp;  // of the last sample
  diagnosis::PeriodWindow window;
  diagnosis::DiagnosisSettings settings;
  std::shared_ptr<const diagnosis::MonitoringCurve> curve;  // null: none is there
  std::optional<diagnosis::Baseline> baseline;
  std::vector<diagnosis::EarlierAnswer> earlier;  // latest of the methods that the settings leave out

  diagnosis::Diagnosis compute() const;
};

/// Works through tasks in their order. Some may wait, so that a moment without processor time loses none. If
/// too many wait, a new task replaces all of them, which is counted; so what is reported is never old.
class DiagnosisWorker {
 public:
  using Work = std::function<void(const DiagnosisTask&)>;

  /// Calls `work` in its thread; what it throws is logged.
  explicit DiagnosisWorker(Work work);
  ~DiagnosisWorker();
  DiagnosisWorker(const DiagnosisWorker&) = delete;
  DiagnosisWorker& operator=(const DiagnosisWorker&) = delete;

  void add(DiagnosisTask task);  ///< does not wait for work
  long replaced() const;         ///< tasks that were never worked on
  /// Whether it has been idle for `times` times the duration of the latest task.
  bool rested(double times) const;
  void stop();  ///< waits for the present task and the latest that waits; then nothing is taken

 private:
  void run();

  Work work_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<DiagnosisTask> waiting_;
  std::size_t samples_ = 0;  // of all that wait
  bool working_ = false;
  std::chrono::steady_clock::time_point began_, ended_;  // of the latest task
  long replaced_ = 0;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace backlash::ros_bridge
