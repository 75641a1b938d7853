#include "backlash_diagnosis/diagnosis/period_analyser.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash {

PeriodAnalyser::PeriodAnalyser(double period, const ApdLayout& layout)
    : period_(period), current_(layout), finished_(layout) {
  if (!(period > 0) || !std::isfinite(period)) throw InvalidParameter("period", period, "must be > 0 s");
}

void PeriodAnalyser::reset() {
  seen_ = 0;
  last_index_ = -1;
  open_ = false;
}

void PeriodAnalyser::open(long index, double time) {
  current_.index = index;
  current_.start = time;
  current_.end = end_of(index);
  current_.apd.clear();
  current_.signal = RunningMoments();
  current_.largest_gap = std::max(0.0, time - (end_of(index) - period_) - 0.5 * interval_);
  last_index_ = index;
  open_ = true;
}

const PeriodResult* PeriodAnalyser::close(double last_time) {
  open_ = false;
  current_.largest_gap = std::max(current_.largest_gap, current_.end - last_time - 0.5 * interval_);
  current_.complete = current_.largest_gap <= std::max(0.05 * period_, 1.5 * interval_);
  std::swap(current_, finished_);
  return &finished_;
}

const PeriodResult* PeriodAnalyser::add(double time, double value) {
  if (++seen_ == 1) {  // the origin needs the distance to the second sample
    first_time_ = last_time_ = time;
    first_value_ = value;
    return nullptr;
  }
  if (seen_ == 2) {
    interval_ = time - first_time_;
    origin_ = first_time_ - 0.5 * interval_;
    open(0, first_time_);
    current_.apd.add(first_value_);
    current_.signal.add(first_value_);
  }
  const PeriodResult* finished = nullptr;
  const long index = static_cast<long>(std::floor((time - origin_) / period_));
  if (open_ && index > current_.index) finished = close(last_time_);
  if (!open_ && index > last_index_) open(index, time);
  if (open_) {  // else: a late sample of a window that was closed already
    current_.apd.add(value);
    current_.signal.add(value);
    current_.largest_gap = std::max(current_.largest_gap, time - std::max(last_time_, current_.start));
    // Closed as soon as the next sample, one interval later, would lie beyond: no waiting for a stream that ends here.
    if (!finished && time + interval_ >= current_.end) finished = close(time);
  }
  last_time_ = time;
  return finished;
}

}  // namespace backlash
