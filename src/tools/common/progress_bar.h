// SPDX-License-Identifier: BSD-3-Clause
// How far long work is, on standard error when that is a terminal.
#pragma once

#include "backlash_diagnosis/base/progress.h"

namespace backlash::tools {

/// Draws on one line, at most ten times a second, and takes the line away when the bar goes out of scope.
class ProgressBar {
 public:
  ProgressBar();
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// To be given to the work; valid as long as the bar. Null where standard error is no terminal.
  Progress progress();

 private:
  bool draw(double fraction, const std::string& phase);

  const bool on_terminal_;
  double next_ = 0;  // s
  bool drawn_ = false;
};

}  // namespace backlash::tools
