// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/time_base.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::record {
namespace {

std::string seconds(double time) {
  return time_text(time) + " s";
}

std::string counted(std::size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace

std::string time_text(double time) {
  char buffer[400];  // the largest double has 309 digits before the point
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, time, std::chars_format::fixed, 9);
  std::string text(buffer, result.ptr);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

StampVerdict StampChecker::next(double stamp) {
  if (!std::isfinite(stamp)) throw InvalidParameter("time", stamp, "must be finite");
  stamp += offset_;
  if (accepted_ > 0 && stamp <= last_) {
    if (stamp < last_ && !(last_ - stamp < kGapFactor * std::min(intervals_[0], intervals_[1])))
      return StampVerdict::backwards;
    if (repeated_++ == 0) first_repeated_ = stamp;
    return StampVerdict::repeated;
  }
  if (accepted_ > 0) intervals_[accepted_ % 2] = stamp - last_;
  last_ = stamp;
  ++accepted_;
  return StampVerdict::accept;
}

bool StampChecker::resume(double stamp) {
  if (double(accepted_ - (steps_.empty() ? 0 : steps_.back().sample)) < kGapFactor) return false;
  steps_.push_back({accepted_++, last_ - offset_ - stamp});
  last_ += 2 * kGapFactor * std::max(intervals_[0], intervals_[1]);  // a gap, whatever the usual interval
  offset_ = last_ - stamp;
  return true;
}

void StampChecker::count_into(Record& record) const {
  record.repeated_stamps = repeated_;
  record.first_repeated_stamp = first_repeated_;
  for (const Step& step : steps_) record.clock_steps.push_back({record.time.at(step.sample), step.back});
}

std::string StampChecker::describe(const std::string& where) const {
  std::string text;
  if (repeated_ > 0)
    text = counted(repeated_, "repeated time stamp") + ": the later sample dropped; first at " +
           (where.empty() ? "" : where + ", ") + "time = " + seconds(first_repeated_);
  for (const Step& step : steps_)
    text += fmt::format("{}the time goes back by {:.4g} s after {}: later times count on behind a gap",
                        text.empty() ? "" : "; ", step.back, counted(step.sample, "sample"));
  return text;
}

double median_interval(const std::vector<double>& time) {
  if (time.size() < 2) return 0;
  std::vector<double> intervals(time.size() - 1);
  for (std::size_t i = 0; i < intervals.size(); ++i) intervals[i] = time[i + 1] - time[i];
  return signal::median(std::move(intervals));
}

std::vector<std::string> describe_time_base(const std::vector<double>& time) {
  if (time.size() < 3) return {};
  const double usual = median_interval(time);
  std::size_t gaps = 0, uneven = 0, longest_gap = 0, most_uneven = 0, regular = 0;
  double longest = 0, largest_deviation = 0, sum = 0, sum_of_squares = 0;  // of the deviation from the median
  for (std::size_t i = 0; i + 1 < time.size(); ++i) {
    const double interval = time[i + 1] - time[i];
    if (interval > kGapFactor * usual) {
      ++gaps;
      if (interval > longest) longest = interval, longest_gap = i;
      continue;
    }
    const double deviation = interval - usual;
    ++regular;
    sum += deviation;
    sum_of_squares += deviation * deviation;
    if (std::abs(deviation) > kJitterFraction * usual) ++uneven;
    if (std::abs(deviation) > largest_deviation) largest_deviation = std::abs(deviation), most_uneven = i;
  }
  std::vector<std::string> warnings;
  const std::string against = fmt::format("median interval {:.6g} s", usual);
  if (gaps > 0) {
    warnings.push_back(fmt::format("{}: the longest {:.6g} s after time = {} ({})", counted(gaps, "time gap"),
                                   longest, seconds(time[longest_gap]), against));
  }
  const double mean = sum / static_cast<double>(regular);  // at least half of the intervals are no gap
  const double deviation =
      std::sqrt(std::max(0.0, sum_of_squares / static_cast<double>(regular) - mean * mean));
  if (deviation > kJitterFraction * usual) {
    warnings.push_back(
        fmt::format("time jitter: standard deviation of the interval {:.3g} % of the {}, {} off by more than "
                    "{:.6g} %, the "
                    "largest by {:.6g} s after time = {}",
                    100 * deviation / usual, against, counted(uneven, "interval"), 100 * kJitterFraction,
                    largest_deviation, seconds(time[most_uneven])));
  }
  return warnings;
}

}  // namespace backlash::record
