// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/feedback.h"

#include <chrono>
#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>

namespace backlash::tools {
namespace {

constexpr double kLineInterval = 0.1;  // s; a choice: what people can follow

volatile std::sig_atomic_t stop_asked = 0;

extern "C" void ask_to_stop(int) {
  stop_asked = 1;
}

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

Option feedback_option() {
  return {"feedback", "",
          "for programs that start this one: report how far it is as one JSON object per line on standard "
          "output, "
          "instead of the summary, and stop on SIGTERM without leaving anything behind"};
}

FeedbackLines::FeedbackLines() {
  std::signal(SIGTERM, ask_to_stop);
}

Progress FeedbackLines::progress() {
  return [this](double fraction, const std::string& phase) { return send(fraction, phase); };
}

BestSoFar FeedbackLines::best_so_far() {
  return [this](const std::string& best) {
    const std::lock_guard<std::mutex> lock(mutex_);
    best_ = best;
    write();
  };
}

bool FeedbackLines::send(double fraction, const std::string& phase) {
  const std::lock_guard<std::mutex> lock(mutex_);
  fraction_ = fraction;
  phase_ = phase;
  if (stop_asked) return false;
  if (steady_seconds() < next_) return true;
  return write();
}

/// False where nobody listens any more.
bool FeedbackLines::write() {
  next_ = steady_seconds() + kLineInterval;
  const nlohmann::ordered_json line = {{"fraction", fraction_}, {"phase", phase_}, {"best", best_}};
  std::cout << line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << std::endl;
  return std::cout.good();
}

}  // namespace backlash::tools
