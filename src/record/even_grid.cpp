// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/even_grid.h"

#include <algorithm>
#include <cmath>

namespace backlash::record {
namespace {

constexpr double kOffGrid = 0.25;  // of an interval, of a stamp: theory, half of what would be the next row

/// `steps`: rows from the sample before. Between samples the line, or Lagrange's cubic through the two to
/// either side.
std::vector<double> filled(const std::vector<double>& from, const std::vector<std::size_t>& steps,
                           bool cubic) {
  std::vector<double> to{from[0]};
  for (std::size_t i = 1; i < from.size(); ++i) {
    const auto h = static_cast<double>(steps[i]);
    const bool inside = cubic && i > 1 && i + 1 < from.size();
    const double before = inside ? -static_cast<double>(steps[i - 1]) : 0;
    const double after = inside ? h + static_cast<double>(steps[i + 1]) : 0;
    for (std::size_t k = 1; k < steps[i]; ++k) {
      const auto x = static_cast<double>(k);
      double value = from[i - 1] + (from[i] - from[i - 1]) * x / h;
      if (inside)
        value = from[i - 2] * x * (x - h) * (x - after) / (before * (before - h) * (before - after)) +
                from[i - 1] * (x - before) * (x - h) * (x - after) / (-before * h * after) +
                from[i] * (x - before) * x * (x - after) / ((h - before) * h * (h - after)) +
                from[i + 1] * (x - before) * x * (x - h) / ((after - before) * after * (after - h));
      to.push_back(value);
    }
    to.push_back(from[i]);
  }
  return to;
}

}  // namespace

bool is_smooth(Channel channel) {
  return channel == Channel::motor_position || channel == Channel::load_position ||
         channel == Channel::reference_position;
}

std::size_t EvenGrid::count(std::size_t first, std::size_t rows) const {
  const auto begin = lost.begin() + static_cast<std::ptrdiff_t>(first);
  return static_cast<std::size_t>(std::count(begin, begin + static_cast<std::ptrdiff_t>(rows), false));
}

EvenGrid even_grid(const Record& record) {
  EvenGrid even{record, std::vector<bool>(record.size(), false)};
  if (record.size() < 3) return even;
  const double dt = record.sampling_interval();
  std::vector<std::size_t> steps(record.size(), 1);  // rows from the sample before
  std::size_t rows = 1;
  for (std::size_t i = 1; i < record.size(); ++i) {
    const double intervals = (record.time[i] - record.time[i - 1]) / dt, whole = std::round(intervals);
    if (whole > static_cast<double>(record.size())) return even;
    if (whole > 1 && std::fabs(intervals - whole) < kOffGrid) steps[i] = static_cast<std::size_t>(whole);
    rows += steps[i];
  }
  if (rows == record.size() || rows > 2 * record.size()) return even;
  even.lost.assign(rows, true);
  even.record.time.clear();
  even.record.time.push_back(record.time[0]);
  even.lost[0] = false;
  for (std::size_t i = 1; i < record.size(); ++i) {
    for (std::size_t k = 1; k <= steps[i]; ++k)
      even.record.time.push_back(record.time[i - 1] +
                                 (record.time[i] - record.time[i - 1]) * double(k) / double(steps[i]));
    even.lost[even.record.time.size() - 1] = false;
  }
  for (const Channel channel : kChannels)
    if (record.has(channel))
      even.record.column(channel) = filled(record.column(channel), steps, is_smooth(channel));
  return even;
}

}  // namespace backlash::record
