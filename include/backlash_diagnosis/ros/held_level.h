// SPDX-License-Identifier: BSD-3-Clause
// An alarm level with hysteresis in time: it rises at once and falls after a hold time.
#pragma once

namespace backlash::ros_bridge {

/// Rises at once; falls to the highest level of the last `hold` seconds.
class HeldLevel {
 public:
  explicit HeldLevel(double hold) : hold_(hold) {}

  void set_hold(double hold) { hold_ = hold; }  ///< s, >= 0

  /// `now` [s] by a clock that never goes back.
  int update(int level, double now) {
    if (level >= held_) {
      held_ = level;
      until_ = now + hold_;
      next_ = 0;
    } else {
      if (level > next_) next_ = level;  // the highest of those since the held one was last seen
      if (now >= until_) {
        held_ = next_;
        until_ = now + hold_;
        next_ = level;
      }
    }
    return held_;
  }

 private:
  double hold_, until_ = 0;
  int held_ = 0, next_ = 0;
};

}  // namespace backlash::ros_bridge
