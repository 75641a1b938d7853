// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/even_grid.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "sample_grid.h"

namespace backlash::record {
double interpolated(const std::vector<double>& time, const std::vector<double>& y, std::size_t j, double t,
                    bool cubic) {
  if (j + 1 >= time.size() || t == time[j]) return y[j];
  if (!cubic || j == 0 || j + 2 >= time.size())
    return y[j] + (y[j + 1] - y[j]) * (t - time[j]) / (time[j + 1] - time[j]);
  double sum = 0;
  for (std::size_t i = j - 1; i <= j + 2; ++i) {
    double weight = 1;
    for (std::size_t k = j - 1; k <= j + 2; ++k)
      if (k != i) weight *= (t - time[k]) / (time[i] - time[k]);
    sum += weight * y[i];
  }
  return sum;
}

namespace {

constexpr double kFarStep = 1e6;  // intervals, of one step: no record of such a gap is one

/// Samples that follow one another, up to a gap in which the phase of their clock is forgotten.
struct ClockRun {
  std::size_t from, to;
};

std::vector<ClockRun> clock_runs(const std::vector<std::size_t>& row) {
  std::vector<ClockRun> runs = {{0, row.size()}};
  for (std::size_t i = 1; i < row.size(); ++i)
    if (row[i] - row[i - 1] > kForgotten) runs.back().to = i, runs.push_back({i, row.size()});
  return runs;
}

/// Row, and time since the first sample of the run.
std::pair<double, double> middle_of(const ClockRun& run, const std::vector<std::size_t>& row,
                                    const std::vector<double>& time) {
  const double n = double(run.to - run.from);
  double rows = 0, mean = 0;
  for (std::size_t i = run.from; i < run.to; ++i)
    rows += double(row[i]), mean += (time[i] - time[run.from]) / n;
  return {rows / n, mean};
}

}  // namespace

std::optional<SampleGrid> grid_of(const std::vector<double>& time, double median) {
  SampleGrid g;
  for (std::size_t i = 1; i < time.size(); ++i)
    if (!((time[i] - time[i - 1]) / median < kFarStep)) return {};
  g.row = rows_of_samples(time, median);
  const std::size_t rows = g.row.back() + 1;
  if (rows > 2 * time.size()) return {};
  const std::vector<ClockRun> runs = clock_runs(g.row);
  double along = 0, square = 0;
  for (const ClockRun& run : runs) {
    const auto [row, mean] = middle_of(run, g.row, time);
    for (std::size_t i = run.from; i < run.to; ++i) {
      along += (double(g.row[i]) - row) * (time[i] - time[run.from] - mean);
      square += std::pow(double(g.row[i]) - row, 2);
    }
  }
  const double interval = square > 0 ? along / square : median;
  for (const ClockRun& run : runs) {
    const auto [row, mean] = middle_of(run, g.row, time);
    const auto on_line = [&, row = row, mean = mean](std::size_t k) {
      return time[run.from] + (mean + (double(k) - row) * interval);
    };
    const std::size_t first = g.row[run.from], gap = g.time.size();
    for (std::size_t k = gap; k < first; ++k) {
      const double last = g.time[gap - 1], share = double(k + 1 - gap) / double(first + 1 - gap);
      g.time.push_back(last + share * (on_line(first) - last));
    }
    for (std::size_t k = first; k <= g.row[run.to - 1]; ++k) g.time.push_back(on_line(k));
  }
  g.lost.assign(rows, true);
  for (std::size_t i = 0; i < time.size(); ++i) {
    g.lost[g.row[i]] = false;
    g.off = std::max(g.off, std::fabs(time[i] - g.time[g.row[i]]) / interval);
  }
  return g;
}

std::vector<double> at_rows(const SampleGrid& g, const std::vector<double>& time,
                            const std::vector<double>& y, bool cubic) {
  std::vector<double> rows;
  rows.reserve(g.time.size());
  std::size_t j = 0;
  for (const double t : g.time) {
    while (j + 2 < time.size() && time[j + 1] <= t) ++j;
    rows.push_back(interpolated(time, y, j, t, cubic));
  }
  return rows;
}

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
  if (record.size() < kOfCubic) return even;
  const std::optional<SampleGrid> grid = grid_of(record.time, record.sampling_interval());
  if (!grid || (grid->off < kEven && grid->time.size() == record.size())) return even;
  const SamplingTimes times = sampling_times(record);
  even.lost = grid->lost;
  even.record.time = grid->time;
  even.record.unsure_time = times.unsure;
  for (const Channel channel : kChannels)
    if (record.has(channel))
      even.record.column(channel) = at_rows(*grid, times.time, record.column(channel), is_smooth(channel));
  return even;
}

}  // namespace backlash::record
