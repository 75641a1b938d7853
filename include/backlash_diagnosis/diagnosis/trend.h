// SPDX-License-Identifier: BSD-3-Clause
// Whether the backlash grows, how fast, and when it reaches a limit.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/history.h"

namespace backlash::diagnosis {

struct TrendPoint {
  double time = 0, value = 0;  // s since 1970, any unit
};

/// NaN where not known; intervals hold with 95 %.
struct Trend {
  bool known = false;                                        // a rate with an interval can be estimated
  bool grows = false;                                        // the interval of the rate is above 0
  bool exceeded = false;                                     // the level is at or above the limit
  double rate = kNaN, rate_lower = kNaN, rate_upper = kNaN;  // unit per s
  double level = kNaN, time = kNaN;                          // of the line at the time of the last point
  std::size_t points = 0;
  double span = 0;  // s

  struct Crossing {
    double time = kNaN, earliest = kNaN, latest = kNaN;  // s since 1970; latest NaN: open
  };
  /// When the level reaches the limit, where one is given and it grows. Where it does not grow but the limit
  /// is exceeded, only `latest` is known: the last point.
  std::optional<Crossing> reaches;

  std::string message;  // one sentence, in um or mrad, dates in UTC; "no trend: ..." with the reason
};

Trend find_trend(std::vector<TrendPoint> points, std::optional<double> limit, bool angular);

/// What a trend may stand on: entries after the last baseline, made with this rig file, with a known value.
std::vector<TrendPoint> trend_points(const std::vector<HistoryEntry>& entries, bool angular,
                                     const std::string& rig_digest);

}  // namespace backlash::diagnosis
