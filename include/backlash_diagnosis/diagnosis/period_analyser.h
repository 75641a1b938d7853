// SPDX-License-Identifier: BSD-3-Clause
// Cuts a signal into whole excitation periods by its stamps and computes the APD of each, sample by sample.
//
// Window k holds the samples with origin + k T <= t < origin + (k+1) T, where the origin lies half a sample
// before the first one, so that stamps that jitter by less than a quarter of a sample never change windows (T
// a whole number of samples). Only stamps count, never the time of arrival: live, replayed and offline give
// the same numbers.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "backlash_diagnosis/diagnosis/amplitude_distribution.h"

namespace backlash::diagnosis {

/// Samples from which the sampling interval of a run is known: the median of the first eight distances, which
/// a lost sample or jitter at the start cannot spoil.
constexpr std::size_t kLeadingSamples = 9;

/// The borders of a run's windows. All that cut a run ask here, so that they agree to the last bit.
struct WindowGrid {
  double origin = 0, period = 0, interval = 0;  // s

  double start(long k) const { return origin + static_cast<double>(k) * period; }
  long index(double time) const;  // window that holds a stamp, with start(k) <= time < start(k + 1)
  /// Windows 0 .. completed - 1 end before the sample that follows a stamp is due.
  long completed(double last) const { return std::max(0L, index(last + interval)); }
};

/// Grid of a run from its first stamps (increasing). Nothing with fewer than kLeadingSamples of them, or for
/// a period shorter than the sampling interval.
std::optional<WindowGrid> window_grid(const std::vector<double>& time, double period);

/// One whole period.
struct PeriodResult {
  explicit PeriodResult(const ApdLayout& layout) : apd(layout) {}
  long index = 0;             // 0 for the first window of the stream
  double start = 0, end = 0;  // s, first sample and end of the window
  AmplitudeDistribution apd;
  RunningMoments signal;
  double largest_gap = 0;  // s, longest time without a sample inside the window
  bool complete = false;   // no gap longer than 5 % of the period (and one sample)
};

class PeriodAnalyser {
 public:
  /// Period [s] > 0; it should span many more than kLeadingSamples samples. Throws InvalidParameter.
  PeriodAnalyser(double period, const ApdLayout& layout);

  /// Adds a sample; stamps must increase (the caller sees to that). Returns a window when this sample
  /// completes it, else null; valid until the next call. Windows that end within the first kLeadingSamples
  /// samples are not returned.
  const PeriodResult* add(double time, double value) {
    if (!(time < calm_until_)) return known_ ? take(time, value) : lead(time, value);
    count(time, value);
    return nullptr;
  }

  /// No more samples will come: returns the open window if its end is less than two samples away, else null.
  const PeriodResult* finish();

  /// Forgets all samples; the next one starts window 0.
  void reset();

  double period() const { return period_; }

 private:
  const PeriodResult* lead(double time, double value);
  const PeriodResult* take(double time, double value);
  void count(double time, double value) {
    current_.apd.add(value);
    current_.signal.add(value);
    if (time - last_time_ > current_.largest_gap) current_.largest_gap = time - last_time_;
    last_time_ = time;
  }
  void open(long index, double time);
  const PeriodResult* close();

  double period_;
  std::vector<std::pair<double, double>> leading_;  // time and value, until the grid is known
  WindowGrid grid_;
  PeriodResult current_, finished_;
  long last_index_ = -1;
  bool known_ = false, open_ = false;
  double last_time_ = 0;
  double calm_until_ =
      -std::numeric_limits<double>::infinity();  // stamps before it only belong to the open window
};

}  // namespace backlash::diagnosis
