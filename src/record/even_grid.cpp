// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/even_grid.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "backlash_diagnosis/signal/order_statistics.h"

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

constexpr double kEven =
    1e-3;  // of an interval, off which a stamp moves no sample: choice, far below any jitter
constexpr double kFarStep = 1e6;  // intervals, of one step: no record of such a gap is one

constexpr double kLong =
    1.3;  // theory: intervals; under jitter of 20 % one in 200 with a lost sample is shorter
constexpr double kSurely = 1.75;    // the same: one in 200 without is longer
constexpr std::size_t kAround = 5;  // choice: samples on each side of a long interval

/// Samples missing between i and i + 1, of which the rows are known up to i.
std::size_t missing_after(const std::vector<double>& time, const std::vector<std::size_t>& rows,
                          std::size_t i, double interval) {
  if (time[i + 1] - time[i] < kLong * interval) return 0;
  std::vector<double> before, after;
  for (std::size_t k = i + 1; k-- > 0 && before.size() < kAround;)
    before.push_back(time[k] / interval + double(rows[i] - rows[k]));
  for (std::size_t k = i + 1; k < time.size() && after.size() < kAround; ++k) {
    if (!after.empty() && time[k] - time[k - 1] >= kSurely * interval) break;
    after.push_back(time[k] / interval - double(k - i - 1));
  }
  return std::size_t(std::max(0.0, std::round(signal::median(after) - signal::median(before)) - 1));
}

struct Grid {
  std::vector<double> time;      // s, of the rows
  std::vector<bool> lost;        // of each row
  std::vector<std::size_t> row;  // of each sample: the nearest
  double off = 0;                // intervals, largest distance of a sample from its row
};

/// Samples count on from one another: a clock that drifts against the median interval does not add up.
std::optional<Grid> grid_of(const std::vector<double>& time, double median) {
  Grid g;
  for (std::size_t i = 1; i < time.size(); ++i)
    if (!((time[i] - time[i - 1]) / median < kFarStep)) return {};
  g.row = rows_of_samples(time, median);
  const std::size_t rows = g.row.back() + 1;
  if (rows > 2 * time.size()) return {};
  const double interval = (time.back() - time.front()) / static_cast<double>(rows - 1);
  for (std::size_t k = 0; k < rows; ++k) g.time.push_back(time[0] + static_cast<double>(k) * interval);
  g.lost.assign(rows, true);
  for (std::size_t i = 0; i < time.size(); ++i) {
    g.lost[g.row[i]] = false;
    g.off = std::max(g.off, std::fabs(time[i] - g.time[g.row[i]]) / interval);
  }
  return g;
}

/// Samples taken at `time`, at the rows of the grid.
std::vector<double> at_rows(const Grid& g, const std::vector<double>& time, const std::vector<double>& y,
                            bool cubic) {
  std::vector<double> rows;
  rows.reserve(g.time.size());
  std::size_t j = 0;
  for (const double t : g.time) {
    while (j + 1 < time.size() && time[j + 1] <= t) ++j;
    rows.push_back(interpolated(time, y, j, t, cubic));
  }
  return rows;
}

/// Mean square of the third differences within recorded rows: of what no motion goes through so fast.
double roughness(const std::vector<double>& y, const std::vector<bool>& lost) {
  double sum = 0;
  for (std::size_t i = 3; i < y.size(); ++i)
    if (!lost[i] && !lost[i - 1] && !lost[i - 2] && !lost[i - 3])
      sum += std::pow(y[i] - 3 * y[i - 1] + 3 * y[i - 2] - y[i - 3], 2);
  return sum;
}

/// The times at which the samples were taken: as stamped, or even, at their rows.
std::vector<double> sampled_at(const Record& record, const Grid& g) {
  std::vector<double> even;
  for (const std::size_t row : g.row) even.push_back(g.time[row]);
  if (g.off < kEven) return even;
  double stamped = 0, counted = 0;
  for (const Channel channel : {Channel::motor_position, Channel::load_position}) {
    if (!record.has(channel)) continue;
    const double a = roughness(at_rows(g, record.time, record.column(channel), true), g.lost),
                 b = roughness(at_rows(g, even, record.column(channel), true), g.lost);
    if (a + b > 0) stamped += a / (a + b), counted += b / (a + b);
  }
  return stamped < counted ? record.time : even;
}

}  // namespace

std::vector<std::size_t> rows_of_samples(const std::vector<double>& time, double interval) {
  std::vector<std::size_t> rows = {0};
  for (std::size_t i = 0; i + 1 < time.size(); ++i)
    rows.push_back(rows[i] + 1 + missing_after(time, rows, i, interval));
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
  if (record.size() < 4) return even;
  const std::optional<Grid> grid = grid_of(record.time, record.sampling_interval());
  if (!grid || (grid->off < kEven && grid->time.size() == record.size())) return even;
  const std::vector<double> time = sampled_at(record, *grid);
  even.lost = grid->lost;
  even.record.time = grid->time;
  for (const Channel channel : kChannels)
    if (record.has(channel))
      even.record.column(channel) = at_rows(*grid, time, record.column(channel), is_smooth(channel));
  return even;
}

std::vector<double> sampling_times(const Record& record) {
  if (record.size() < 4) return record.time;
  const std::optional<Grid> grid = grid_of(record.time, record.sampling_interval());
  return grid ? sampled_at(record, *grid) : record.time;
}

}  // namespace backlash::record
