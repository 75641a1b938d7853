// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/diagnosis_worker.h"

#include <ros/console.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <exception>
#include <utility>

namespace backlash::ros_bridge {
namespace {

constexpr std::size_t kMostWaiting = 8;  // tasks; a choice: two seconds of estimates at the default interval
constexpr std::size_t kMostSamplesWaiting = 1'000'000;  // of all tasks; a choice: 80 MB with all channels
constexpr int kNiceness = 5;  // a choice: samples are taken first where processors are short

/// Of this thread only: Linux keeps a niceness for each.
void yield_to_samples() {
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNiceness);
}

}  // namespace

diagnosis::Diagnosis DiagnosisTask::compute() const {
  diagnosis::Diagnosis diagnosis = diagnosis::diagnose(window, settings, curve.get(), baseline);
  for (const diagnosis::EarlierAnswer& answer : earlier)
    diagnosis::recall(diagnosis, answer, window, settings.limits, baseline);
  return diagnosis;
}

DiagnosisWorker::DiagnosisWorker(Work work) : work_(std::move(work)), thread_(&DiagnosisWorker::run, this) {}

DiagnosisWorker::~DiagnosisWorker() {
  stop();
}

void DiagnosisWorker::add(DiagnosisTask task) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (stop_) return;
  samples_ += task.window.record.size();
  if (waiting_.size() >= kMostWaiting || samples_ > kMostSamplesWaiting) {
    replaced_ += static_cast<long>(waiting_.size());
    waiting_.clear();
    samples_ = task.window.record.size();
  }
  waiting_.push_back(std::move(task));
  changed_.notify_one();
}

long DiagnosisWorker::replaced() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return replaced_;
}

bool DiagnosisWorker::rested(double times) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (working_ || !waiting_.empty()) return false;
  return std::chrono::steady_clock::now() - ended_ >= times * (ended_ - began_);
}

void DiagnosisWorker::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
    for (; waiting_.size() > 1; ++replaced_) waiting_.pop_front();
    changed_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

void DiagnosisWorker::run() {
  yield_to_samples();
  for (;;) {
    DiagnosisTask task;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      task = std::move(waiting_.front());
      waiting_.pop_front();
      samples_ -= task.window.record.size();
      working_ = true;
      began_ = std::chrono::steady_clock::now();
    }
    try {
      work_(task);
    } catch (const std::exception& error) {
      ROS_ERROR("a diagnosis failed: %s", error.what());
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    working_ = false;
    ended_ = std::chrono::steady_clock::now();
  }
}

}  // namespace backlash::ros_bridge
