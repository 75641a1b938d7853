// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/resampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "check_parts.h"

namespace backlash::record {
namespace {

constexpr double kWorthwhile = 0.1;  // choice: of the longest part
constexpr double kKept = 0.4;        // choice: of a sampling rate, that a low-pass keeps before it

EvenGrid on_grid(const EvenGrid& from, double interval) {
  const Record& record = from.record;
  EvenGrid out;
  out.record.name = record.name;
  out.record.warnings = record.warnings;
  out.record.origin = record.origin;
  out.record.whole_from = record.whole_from;
  std::size_t j = 0;
  for (double t = record.time.front(); t <= record.time.back();
       t = record.time.front() + double(out.record.time.size()) * interval) {
    while (j + 2 < record.size() && record.time[j + 1] < t) ++j;
    out.record.time.push_back(t);
    out.lost.push_back(from.lost[j] || from.lost[j + 1]);
    for (const Channel channel : kChannels)
      if (const auto& in = record.column(channel); !in.empty())
        out.record.column(channel).push_back(interpolated(record.time, in, j, t, is_smooth(channel)));
  }
  return out;
}

EvenGrid even_rows(const Record& record, double longest) {
  const double interval = record.sampling_interval();
  if (record.size() < 4) throw BadData(record.name, "has only " + std::to_string(record.size()) + " samples");
  for (std::size_t k = 1; k < record.size(); ++k)
    if (record.time[k] - record.time[k - 1] > longest * interval)
      throw BadData(record.name, "a gap of " + to_text(record.time[k] - record.time[k - 1]) +
                                     " s after t = " + time_text(record.time[k - 1]) +
                                     " s: give the parts as records of their own");
  EvenGrid grid = even_grid(record);
  const std::vector<double>& time = grid.record.time;
  const double even = (time.back() - time.front()) / double(time.size() - 1);
  double worst = 0;
  for (std::size_t k = 0; k < time.size(); ++k)
    worst = std::max(worst, std::fabs(time[k] - time.front() - double(k) * even));
  return worst <= 0.01 * even ? grid : on_grid(grid, interval);
}

}  // namespace

EvenGrid evenly_sampled_grid(const Record& record) {
  return even_rows(record, kLongestFilled);
}

Record evenly_sampled(const Record& record) {
  return even_rows(record, kGapFactor).record;
}

std::vector<Record> parts_between_gaps(Record record) {
  const double longest = kLongestFilled * record.sampling_interval();
  std::vector<double> starts = {record.size() > 0 ? record.time.front() : 0};
  double duration = 0;
  for (std::size_t k = 1; k < record.size(); ++k) {
    if (record.time[k] - record.time[k - 1] > longest) starts.push_back(record.time[k]);
    duration = std::max(duration, record.time[k] - starts.back());
  }
  if (starts.size() == 1) return {std::move(record)};
  std::vector<std::string> used;
  std::vector<Record> parts;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    Record part = record.slice(starts[i], i + 1 < starts.size() ? starts[i + 1] : INFINITY);
    if (part.time.back() - part.time.front() < kWorthwhile * duration) continue;
    used.push_back(fmt::format("{:.6g} to {:.6g} s", part.time.front(), part.time.back()));
    part.name += fmt::format(" from {:.6g} s", part.time.front());
    if (!parts.empty()) part.warnings.clear();
    parts.push_back(std::move(part));
  }
  parts.front().warnings.push_back(fmt::format("cut at {} of more than {:.4g} s; used are {}",
                                               counted(starts.size() - 1, "gap"), longest, joined(used)));
  return parts;
}

EvenGrid resampled(const Record& record, double interval) {
  EvenGrid grid = evenly_sampled_grid(record);
  const double own = grid.record.sampling_interval();
  if (!(interval >= own))
    throw InvalidParameter("interval", interval, "must be that of the record or longer");
  for (const Channel channel : kChannels)
    if (std::vector<double>& column = grid.record.column(channel); !column.empty() && !is_smooth(channel))
      column = signal::low_pass(column, own, kKept / interval);
  return on_grid(grid, interval);
}

}  // namespace backlash::record
