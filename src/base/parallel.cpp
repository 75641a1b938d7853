// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/parallel.h"

#include <algorithm>
#include <exception>
#include <thread>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/interruption.h"

namespace backlash {

void Ticker::tick() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++done_;
  if (!stop_ && progress_ && !progress_(double(done_) / double(total_), phase_)) stop_ = true;
  if (stop_) throw Cancelled();
}

namespace {

void work_in_parallel(int count, Ticker& ticker, const std::function<void(int)>& job, unsigned threads) {
  std::atomic<int> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    for (int i = next++; i < count && !ticker.stopped(); i = next++) try {
        stop_if_interrupted();
        job(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!failure) failure = std::current_exception();
        ticker.stop();
      }
  };
  const auto helper = [&, interruption = Interruption::current()] {
    const Interruption::Inherited inherited(interruption);
    work();
  };
  std::vector<std::thread> helpers;
  const unsigned workers =
      std::min<unsigned>(threads > 0 ? threads : std::thread::hardware_concurrency(), count);
  for (unsigned i = 1; i < workers; ++i) helpers.emplace_back(helper);
  work();
  for (std::thread& thread : helpers) thread.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace

void for_each_in_parallel(int count, Ticker& ticker, const std::function<void(int)>& job) {
  work_in_parallel(count, ticker, job, 0);
}

void for_each_in_parallel(int count, const std::function<void(int)>& job, unsigned threads) {
  const Progress silent;
  Ticker ticker(silent, count, "");
  work_in_parallel(count, ticker, job, threads);
}

}  // namespace backlash
