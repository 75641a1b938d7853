// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

namespace backlash::tools {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

ProgressBar::ProgressBar() : on_terminal_(::isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (drawn_) std::fputs("\r\033[K", stderr);
}

Progress ProgressBar::progress() {
  if (!on_terminal_) return nullptr;
  return [this](double fraction, const std::string& phase) { return draw(fraction, phase); };
}

bool ProgressBar::draw(double fraction, const std::string& phase) {
  constexpr int kWidth = 40;
  if (now() < next_) return true;
  next_ = now() + 0.1;
  const double share = std::clamp(fraction, 0.0, 1.0);
  const int filled = static_cast<int>(std::lround(share * kWidth));
  std::fprintf(stderr, "\r\033[K%s [%s%s] %3.0f %%", phase.c_str(), std::string(filled, '#').c_str(),
               std::string(kWidth - filled, '-').c_str(), 100 * share);
  std::fflush(stderr);
  drawn_ = true;
  return true;
}

}  // namespace backlash::tools
