// SPDX-License-Identifier: BSD-3-Clause
#include "trend_message.h"

#include <fmt/core.h>

#include <cmath>

#include "backlash_diagnosis/base/utc.h"

namespace backlash::diagnosis {
namespace {

constexpr double kDay = 86400, kYear = 365.25 * kDay;

/// Three digits, plain ones also where the shortest form has an exponent.
std::string number(double value) {
  return std::abs(value) >= 100 ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value);
}

struct Words {
  double scale;  // from SI
  const char* unit;

  std::string amount(double value) const { return number(scale * value) + " " + unit; }
  /// "12.3 um per year (95 %: 10 to 15)"; per day where that would be much.
  std::string rate(const Trend& t) const {
    const bool fast = std::abs(scale * t.rate * kYear) >= 1e4;
    const double by = scale * (fast ? kDay : kYear);
    return number(by * t.rate) + " " + unit + (fast ? " per day" : " per year") +
           " (95 %: " + number(by * t.rate_lower) + " to " + number(by * t.rate_upper) + ")";
  }
};

/// Dates; with the time of day where the interval is shorter than two days.
std::string date(const Trend::Crossing& c) {
  const bool precise = c.latest - c.earliest < 2 * kDay;
  const auto text = [precise](double time) {
    const std::string full = utc_time(time);
    if (full.empty()) return std::string("after the year 9999");
    return precise ? full.substr(0, 10) + " " + full.substr(11, 5) : full.substr(0, 10);
  };
  const std::string latest = std::isnan(c.latest) ? " or later" : " to " + text(c.latest);
  return text(c.time) + " (" + text(c.earliest) + latest + ")";
}

std::string span_text(double span) {
  return span < 2 * kDay ? number(span / 3600) + " h" : number(span / kDay) + " days";
}

std::string no_trend(const Trend& t, std::size_t times, const Words& words) {
  if (times < kFewestTimes)
    return std::to_string(times) + " points at different times, at least " + std::to_string(kFewestTimes) +
           " are needed";
  if (t.span < kShortestSpan)
    return "the points span " + span_text(t.span) + ", at least " + span_text(kShortestSpan) + " are needed";
  if (!t.known)
    return "the errors of the " + std::to_string(t.points) + " points over " + span_text(t.span) +
           " hang together for too long; later points will show more";
  const std::string what = t.rate_upper < 0 ? "shrinks by " : "growth is not distinguished from none: ";
  return what + words.rate(t);
}

}  // namespace

std::string trend_message(const Trend& t, std::size_t times, std::optional<double> limit, bool angular) {
  const Words words = angular ? Words{1e3, "mrad"} : Words{1e6, "um"};
  std::string text = t.grows ? "grows by " + words.rate(t) : "no trend: " + no_trend(t, times, words);
  if (!limit) return text;
  if (!t.grows) return t.exceeded ? text + "; exceeds " + words.amount(*limit) + " already" : text;
  return text + (t.exceeded ? ", exceeds " : ", reaches ") + words.amount(*limit) +
         (t.exceeded ? " since " : " on ") + date(*t.reaches);
}

}  // namespace backlash::diagnosis
