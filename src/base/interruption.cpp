// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/interruption.h"

#include <atomic>
#include <chrono>
#include <mutex>
#include <utility>

#include "backlash_diagnosis/base/error.h"

namespace backlash {

using Clock = std::chrono::steady_clock;

struct Interruption::State {
  std::function<bool()> go_on;
  std::atomic<bool> stopped{false};
  std::mutex mutex;
  Clock::time_point next = Clock::now();
};

namespace {

constexpr std::chrono::milliseconds kInterval{100};

thread_local std::shared_ptr<Interruption::State> present;

}  // namespace

Interruption::Interruption(std::function<bool()> go_on) : before_(std::move(present)) {
  present = std::make_shared<State>();
  present->go_on = std::move(go_on);
}

Interruption::~Interruption() {
  present = std::move(before_);
}

std::shared_ptr<Interruption::State> Interruption::current() {
  return present;
}

Interruption::Inherited::Inherited(std::shared_ptr<State> state) : before_(std::move(present)) {
  present = std::move(state);
}

Interruption::Inherited::~Inherited() {
  present = std::move(before_);
}

void stop_if_interrupted() {
  Interruption::State* const state = present.get();
  if (!state) return;
  if (!state->stopped) {
    const std::unique_lock<std::mutex> lock(state->mutex, std::try_to_lock);
    if (!lock || Clock::now() < state->next) return;  // who holds it asks already
    if (!state->go_on()) state->stopped = true;
    state->next = Clock::now() + kInterval;
  }
  if (state->stopped) throw Cancelled();
}

}  // namespace backlash
