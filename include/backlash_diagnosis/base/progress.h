// SPDX-License-Identifier: BSD-3-Clause
// How long work reports how far it is and learns that it should stop. One type for progress bars, action
// feedback and cancel.
#pragma once

#include <functional>
#include <string>

namespace backlash {

/// Called now and then with the fraction done (0..1) and what is being worked on; returns false to cancel.
/// May be called from worker threads, never from two at the same time.
using Progress = std::function<bool(double fraction, const std::string& phase)>;

/// Called with a short text on the best result so far whenever that changes; possibly from a worker thread,
/// never from two at once.
using BestSoFar = std::function<void(const std::string& best)>;

}  // namespace backlash
