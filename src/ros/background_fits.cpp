// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/background_fits.h"

#include <ros/console.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/interruption.h"

namespace backlash::ros_bridge {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kLowestPriority = 19;  // niceness: what nobody else wants of the processors
constexpr int kRest = 3;             // times as long as the fit took: a quarter of the time is fits; a choice
constexpr std::chrono::milliseconds kLeastRest{500};  // a choice: of fits that give up at once
constexpr std::chrono::seconds kMostRest{5};     // a choice: so that answers of a slow machine are no older
constexpr std::chrono::milliseconds kIdle{100};  // from one look for new samples to the next; a choice

/// Of this thread, and of those that it starts: Linux keeps a niceness for each, and hands it on.
void yield_to_all() {
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kLowestPriority);
}

}  // namespace

BackgroundFits::BackgroundFits() : thread_(&BackgroundFits::run, this) {}

BackgroundFits::~BackgroundFits() {
  stop();
}

void BackgroundFits::add(const void* owner, Fit fit) {
  const std::lock_guard<std::mutex> lock(mutex_);
  turns_.push_back({owner, std::move(fit)});
  changed_.notify_all();
}

void BackgroundFits::remove(const void* owner) {
  std::unique_lock<std::mutex> lock(mutex_);
  turns_.remove_if([owner](const Turn& turn) { return turn.owner == owner; });
  if (present_ == owner) cancel_ = true;
  changed_.wait(lock, [this, owner] { return present_ != owner; });
}

void BackgroundFits::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

bool BackgroundFits::wanted() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return !cancel_ && !stop_;
}

/// The first fit in turn that has something to do; false where none has.
bool BackgroundFits::one() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (std::size_t left = turns_.size(); left > 0 && !turns_.empty() && !stop_; --left) {
    turns_.splice(turns_.end(), turns_, turns_.begin());
    const Fit fit = turns_.back().fit;
    present_ = turns_.back().owner;
    cancel_ = false;
    lock.unlock();
    bool done = true;
    try {
      const Interruption interruption([this] { return wanted(); });
      done = fit();
    } catch (const Cancelled&) {
    } catch (const std::exception& error) {
      if (problem_ != error.what()) ROS_ERROR("a fit failed: %s", error.what());
      problem_ = error.what();
    }
    lock.lock();
    present_ = nullptr;
    changed_.notify_all();
    if (done) return true;
  }
  return false;
}

void BackgroundFits::run() {
  yield_to_all();
  for (;;) {
    const Clock::time_point start = Clock::now();
    const bool done = one();
    const auto rest =
        done ? std::clamp<Clock::duration>(kRest * (Clock::now() - start), kLeastRest, kMostRest) : kIdle;
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait_for(lock, rest, [this] { return stop_; });
    if (stop_) return;
  }
}

}  // namespace backlash::ros_bridge
