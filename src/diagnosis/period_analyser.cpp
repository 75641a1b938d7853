// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/period_analyser.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/time_base.h"

namespace backlash::diagnosis {

long WindowGrid::index(double time) const {
  auto k = static_cast<long>(std::floor((time - origin) / period));
  while (time >= start(k + 1)) ++k;  // the quotient may be one unit in the last place off
  while (time < start(k)) --k;
  return k;
}

std::optional<WindowGrid> window_grid(const std::vector<double>& time, double period) {
  if (time.size() < kLeadingSamples) return std::nullopt;
  WindowGrid grid;
  grid.period = period;
  grid.interval = record::median_interval({time.begin(), time.begin() + kLeadingSamples});
  grid.origin = time.front() - 0.5 * grid.interval;
  if (!(period >= grid.interval)) return std::nullopt;
  return grid;
}

PeriodAnalyser::PeriodAnalyser(double period, const ApdLayout& layout)
    : period_(period), current_(layout), finished_(layout) {
  if (!(period > 0) || !std::isfinite(period)) throw InvalidParameter("period", period, "must be > 0 s");
}

void PeriodAnalyser::reset() {
  leading_.clear();
  last_index_ = -1;
  known_ = open_ = false;
  calm_until_ = -std::numeric_limits<double>::infinity();
}

const PeriodResult* PeriodAnalyser::lead(double time, double value) {
  leading_.emplace_back(time, value);
  if (leading_.size() < kLeadingSamples) return nullptr;
  std::vector<double> stamps;
  for (const auto& sample : leading_) stamps.push_back(sample.first);
  const auto grid = window_grid(stamps, period_);
  if (!grid) {  // a period shorter than the sampling interval has no windows
    leading_.pop_back();
    return nullptr;
  }
  grid_ = *grid;
  known_ = true;
  const PeriodResult* finished = nullptr;
  for (const auto& sample : leading_) finished = take(sample.first, sample.second);
  return finished;
}

const PeriodResult* PeriodAnalyser::take(double time, double value) {
  const PeriodResult* finished = nullptr;
  const long index = open_ && time < current_.end ? current_.index : grid_.index(time);  // stamps increase
  if (open_ && index > current_.index) finished = close();
  if (!open_ && index > last_index_) open(index, time);
  if (open_) count(time, value);  // else: a late sample of a window that was closed already
  last_time_ = time;
  // Closed as soon as the next sample, even a quarter early, would lie beyond: no waiting for a stream that
  // ends here.
  if (open_ && !finished && time + 0.75 * grid_.interval >= current_.end) finished = close();
  return finished;
}

const PeriodResult* PeriodAnalyser::finish() {
  // A record cut at windows that are no whole number of samples: the first stamp may lie up to an interval
  // after the cut and the last up to one before it, so that windows counted from the first stamp end up
  // to 1.5 intervals after the last; jitter comes on top.
  return open_ && last_time_ + 2 * grid_.interval >= current_.end ? close() : nullptr;
}

void PeriodAnalyser::open(long index, double time) {
  current_.index = index;
  current_.start = time;
  current_.end = grid_.start(index + 1);
  current_.apd.clear();
  current_.signal = RunningMoments();
  current_.largest_gap = std::max(0.0, time - grid_.start(index) - 0.5 * grid_.interval);
  last_time_ = time;
  last_index_ = index;
  calm_until_ = current_.end - grid_.interval;
  open_ = true;
}

const PeriodResult* PeriodAnalyser::close() {
  open_ = false;
  calm_until_ = -std::numeric_limits<double>::infinity();
  current_.largest_gap = std::max(current_.largest_gap, current_.end - last_time_ - 0.5 * grid_.interval);
  current_.complete = current_.largest_gap <= std::max(0.05 * period_, 1.5 * grid_.interval);
  std::swap(current_, finished_);
  return &finished_;
}

}  // namespace backlash::diagnosis
