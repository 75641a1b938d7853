// Cuts a signal into whole excitation periods by its stamps and computes the APD of each, sample by sample.
//
// Window k holds the samples with origin + k T <= t < origin + (k+1) T, where the origin lies half a sample before the
// first one, so that stamps that jitter by less than half a sample never change windows. Only stamps count, never the
// time of arrival: live, replayed and offline give the same numbers.
#pragma once

#include "backlash_diagnosis/diagnosis/amplitude_distribution.h"

namespace backlash {

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
  /// Period [s] > 0. Throws InvalidParameter.
  PeriodAnalyser(double period, const ApdLayout& layout);

  /// Adds a sample; stamps must increase (the caller sees to that). Returns a window when this sample completes it, else
  /// null; valid until the next call.
  const PeriodResult* add(double time, double value);

  /// Forgets all samples; the next one starts window 0.
  void reset();

  double period() const { return period_; }

 private:
  void open(long index, double time);
  const PeriodResult* close(double last_time);
  double end_of(long index) const { return origin_ + (index + 1) * period_; }

  double period_;
  PeriodResult current_, finished_;
  long seen_ = 0, last_index_ = -1;
  bool open_ = false;
  double first_time_ = 0, first_value_ = 0, origin_ = 0, interval_ = 0, last_time_ = 0;
};

}  // namespace backlash
