// SPDX-License-Identifier: BSD-3-Clause
// Cancel that reaches into long numerical loops: a fit of a minute has no progress to report, but must end
// within a second when its caller no longer wants it.
#pragma once

#include <functional>
#include <memory>

namespace backlash {

/// While it lives, loops of this thread, and of those that for_each_in_parallel starts from it, ask `go_on`
/// now and then, ten times a second at most and never from two threads at the same time. Innermost of several
/// only.
class Interruption {
 public:
  struct State;
  explicit Interruption(std::function<bool()> go_on);
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// The interruption of this thread, for another thread to take over; null where there is none.
  static std::shared_ptr<State> current();

  /// Takes over that of another thread while it lives.
  class Inherited {
   public:
    explicit Inherited(std::shared_ptr<State> state);
    ~Inherited();
    Inherited(const Inherited&) = delete;
    Inherited& operator=(const Inherited&) = delete;

   private:
    std::shared_ptr<State> before_;
  };

 private:
  std::shared_ptr<State> before_;
};

/// Throws Cancelled where this thread's work is no longer wanted. Cheap: for the inside of loops.
void stop_if_interrupted();

}  // namespace backlash
