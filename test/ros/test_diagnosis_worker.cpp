// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <stdexcept>
#include <thread>
#include <vector>

#include "backlash_diagnosis/ros/diagnosis_worker.h"

namespace backlash::ros_bridge {
namespace {

DiagnosisTask task_of(int number, std::size_t samples = 1) {
  DiagnosisTask task;
  task.stamp = ros::Time(1000 + number, 0);
  task.window.record.time.resize(samples);
  return task;
}

/// Work that lasts until it is allowed to end.
struct Slow {
  std::promise<void> began, allowed;
  std::vector<int> done;  // of the worker's thread until it is stopped
  bool first = true;

  DiagnosisWorker::Work work() {
    return [this](const DiagnosisTask& task) {
      if (first) {
        first = false;
        began.set_value();
        allowed.get_future().wait();
      }
      done.push_back(static_cast<int>(task.stamp.sec) - 1000);
    };
  }
};

std::vector<int> numbers(int from, int to) {
  std::vector<int> all;
  for (int i = from; i <= to; ++i) all.push_back(i);
  return all;
}

TEST(DiagnosisWorker, AMomentWithoutProcessorTimeLosesNone) {
  Slow slow;
  std::promise<void> last;
  const DiagnosisWorker::Work work = slow.work();
  DiagnosisWorker worker([&](const DiagnosisTask& task) {
    work(task);
    if (task.stamp.sec == 1008) last.set_value();
  });
  worker.add(task_of(0));
  slow.began.get_future().wait();
  for (int i = 1; i <= 8; ++i) worker.add(task_of(i));
  slow.allowed.set_value();
  last.get_future().wait();
  worker.stop();
  EXPECT_EQ(slow.done, numbers(0, 8));
  EXPECT_EQ(worker.replaced(), 0);
}

TEST(DiagnosisWorker, TheLatestReplacesThoseThatWaitTooLong) {
  Slow slow;
  DiagnosisWorker worker(slow.work());
  worker.add(task_of(0));
  slow.began.get_future().wait();
  for (int i = 1; i <= 9; ++i) worker.add(task_of(i));
  EXPECT_EQ(worker.replaced(), 8);
  slow.allowed.set_value();
  worker.stop();
  EXPECT_EQ(slow.done, (std::vector<int>{0, 9}));
  worker.add(task_of(10));  // too late
  EXPECT_EQ(worker.replaced(), 8);
}

TEST(DiagnosisWorker, LongWindowsDoNotPileUp) {
  Slow slow;
  DiagnosisWorker worker(slow.work());
  worker.add(task_of(0));
  slow.began.get_future().wait();
  for (int i = 1; i <= 3; ++i) worker.add(task_of(i, 600'000));
  EXPECT_EQ(worker.replaced(), 2);
  slow.allowed.set_value();
  worker.stop();
  EXPECT_EQ(slow.done, (std::vector<int>{0, 3}));
}

TEST(DiagnosisWorker, WhatFailsEndsNothing) {
  std::atomic<int> done{0};
  DiagnosisWorker worker([&done](const DiagnosisTask&) {
    ++done;
    throw std::runtime_error("on purpose");
  });
  worker.add(task_of(0));
  while (done == 0) std::this_thread::yield();
  worker.add(task_of(1));
  worker.stop();
  EXPECT_EQ(done, 2);
}

}  // namespace
}  // namespace backlash::ros_bridge
