// SPDX-License-Identifier: BSD-3-Clause
// Fits that take seconds, of all joints: one at a time, in a thread of the lowest priority, which rests
// between them.
#pragma once

#include <condition_variable>
#include <functional>
#include <list>
#include <mutex>
#include <string>
#include <thread>

namespace backlash::ros_bridge {

class BackgroundFits {
 public:
  /// Fits the newest samples of a joint; false if there are none that it has not fitted yet. Its loops end
  /// with Cancelled soon after remove() (base/interruption.h).
  using Fit = std::function<bool()>;

  BackgroundFits();
  ~BackgroundFits();
  BackgroundFits(const BackgroundFits&) = delete;
  BackgroundFits& operator=(const BackgroundFits&) = delete;

  /// From now on `fit` is called in turn with the others. What it throws is logged; the same text in
  /// succession only once.
  void add(const void* owner, Fit fit);
  void remove(const void* owner);  ///< cancels its present fit, and waits for its end
  void stop();                     ///< the same of all, for good

 private:
  struct Turn {
    const void* owner;
    Fit fit;
  };
  void run();
  bool one();
  bool wanted();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::list<Turn> turns_;          // the next one first
  std::string problem_;            // that was logged last; used by the thread alone
  const void* present_ = nullptr;  // whose fit runs
  bool cancel_ = false, stop_ = false;
  std::thread thread_;
};

}  // namespace backlash::ros_bridge
