// SPDX-License-Identifier: BSD-3-Clause
// How far a command is, for the program that started it: option --feedback.
#pragma once

#include <mutex>
#include <string>

#include "backlash_diagnosis/base/progress.h"
#include "tools/common/command_line.h"

namespace backlash::tools {

Option feedback_option();

/// {"fraction":0.5,"phase":"...","best":"..."} as lines on standard output: at once where the best so far is
/// another, else ten times a second at most. From then on SIGTERM asks the work to stop.
class FeedbackLines {
 public:
  FeedbackLines();
  FeedbackLines(const FeedbackLines&) = delete;
  FeedbackLines& operator=(const FeedbackLines&) = delete;

  /// To be given to the work; valid as long as this.
  Progress progress();
  BestSoFar best_so_far();

 private:
  bool send(double fraction, const std::string& phase);
  bool write();

  std::mutex mutex_;  // both may be called at the same time
  double fraction_ = 0;
  std::string phase_ = "starting", best_;
  double next_ = 0;  // s
};

}  // namespace backlash::tools
