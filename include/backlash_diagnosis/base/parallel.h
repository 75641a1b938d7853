// SPDX-License-Identifier: BSD-3-Clause
// Long work on all processors, with one progress for all of them.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <string>

#include "backlash_diagnosis/base/progress.h"

namespace backlash {

/// Progress of all workers together; learns from it whether to stop.
class Ticker {
 public:
  Ticker(const Progress& progress, long total, std::string phase)
      : progress_(progress), total_(total), phase_(std::move(phase)) {}

  void tick();  ///< one more tick is done; throws Cancelled
  void stop() { stop_ = true; }
  bool stopped() const { return stop_; }

 private:
  const Progress& progress_;
  long total_, done_ = 0;
  std::string phase_;
  std::mutex mutex_;
  std::atomic<bool> stop_{false};
};

/// Calls job(0) .. job(count - 1) on all processors, in any order; the first exception stops them and is
/// thrown.
void for_each_in_parallel(int count, Ticker& ticker, const std::function<void(int)>& job);

/// The same without progress; with as many threads as said, 0: all processors.
void for_each_in_parallel(int count, const std::function<void(int)>& job, unsigned threads = 0);

}  // namespace backlash
