// SPDX-License-Identifier: BSD-3-Clause
// When samples were taken whose stamps jitter.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/local_parabola.h"
#include "sample_grid.h"

namespace backlash::record {
namespace {

constexpr double kSureOff = 3;  // theory: standard errors, within which nothing, or all, is no finding
// Theory: third differences of white noise follow one another with -0.75, 0.3 and -0.05, which multiplies an
// error by up to sqrt(1 + 2 (0.75 + 0.3 + 0.05)).
constexpr double kNeighbours = 1.79;
constexpr int kPasses = 4;          // choice: each leaves a tenth of the error of the share before
constexpr double kExact = 1e-12;    // of the squares, that rounding leaves
constexpr std::size_t kAcross = 3;  // theory: rows of a third difference of rates
constexpr std::size_t kReach = 4;   // choice: samples to each side, over which the motion is a parabola
constexpr double kWithin = 0.25;    // choice: of an interval, by which no sample passes its neighbour
constexpr double kMostLate = 3;     // theory: deviations, beyond which a sample is late by no chance

/// Third difference about y[k] and y[k + 1].
double rough(const std::vector<double>& y, std::size_t k) {
  return y[k + 2] - 3 * y[k + 1] + 3 * y[k] - y[k - 1];
}

/// Whether all samples from `reach` before to `reach` after row k were recorded.
bool whole(const SampleGrid& g, std::size_t k, std::size_t reach) {
  const auto from = g.lost.begin() + std::ptrdiff_t(k - reach),
             to = g.lost.begin() + std::ptrdiff_t(k + reach + 1);
  return std::find(from, to, true) == to;
}

/// Sums of a regression through the origin.
struct Slope {
  double xx = 0, xy = 0, yy = 0, count = 0;
};

/// A sample that was taken `off` [s] beside its row, and not brought there, is off by the rate times that.
/// Third differences, which no motion goes through so fast, say for which share of `off` this holds.
void add_share(Slope& all, const SampleGrid& g, const std::vector<double>& off,
               const std::vector<double>& y) {
  Slope slope;
  std::vector<double> shown(y.size(), 0.0);
  for (std::size_t k = 1; k + 1 < y.size(); ++k)
    shown[k] = off[k] * (y[k + 1] - y[k - 1]) / (2 * (g.time[1] - g.time[0]));
  for (std::size_t k = kAcross; k + kAcross < y.size(); ++k) {
    if (!whole(g, k, kAcross)) continue;
    const double b = rough(y, k), a = rough(shown, k);
    slope.xx += a * a, slope.xy += a * b, slope.yy += b * b, ++slope.count;
  }
  if (!(slope.xx > 0)) return;
  const double noise = std::max(slope.yy - slope.xy * slope.xy / slope.xx, kExact * slope.yy) / slope.count;
  all.xx += slope.xx / noise, all.xy += slope.xy / noise;
}

/// The mean of both positions in which motor and load, as they swing against each other, cancel: the centre
/// of their inertia, which only slow torques move. It is the mean with the least third differences.
std::vector<double> centre_of(const std::vector<double>& motor, const std::vector<double>& load) {
  double along = 0, squares = 0;
  for (std::size_t k = 1; k + 2 < load.size(); ++k) {
    const double of_load = rough(load, k), apart = of_load - rough(motor, k);
    along += of_load * apart, squares += apart * apart;
  }
  const double share = squares > 0 ? along / squares : 0;
  std::vector<double> centre;
  for (std::size_t k = 0; k < load.size(); ++k) centre.push_back(load[k] - share * (load[k] - motor[k]));
  return centre;
}

/// A sample that is late by t is off the parabola through its neighbours by the rate of the centre of inertia
/// times t. What is off at any rate is noise: a regression of the squares on those of the rate separates
/// both.
SamplingTimes by_motion(const Record& record, const SampleGrid& g, SamplingTimes times) {
  if (!record.has(Channel::motor_position)) return times;
  const auto rows = [&](Channel channel) { return at_rows(g, times.time, record.column(channel), true); };
  std::vector<double> centre = rows(Channel::motor_position);
  if (record.has(Channel::load_position)) centre = centre_of(centre, rows(Channel::load_position));
  const signal::LocalParabola parabola(kReach);
  const double interval = g.time[1] - g.time[0], slow = parabola.value[kReach];
  std::vector<double> off(centre.size(), 0.0), rate(centre.size(), 0.0);
  double n = 0, vv = 0, vvvv = 0, rr = 0, vvrr = 0;
  for (std::size_t k = kReach; k + kReach < centre.size(); ++k) {
    if (!whole(g, k, kReach)) continue;
    rate[k] = parabola.of(centre, k, parabola.slope) / interval;
    off[k] = centre[k] - parabola.of(centre, k, parabola.value);
    const double v = rate[k] * rate[k], r = off[k] * off[k];
    ++n, vv += v, vvvv += v * v, rr += r, vvrr += v * r;
  }
  const double scatter = n * vvvv - vv * vv;
  if (!(scatter > 0)) return times;
  const double late = (n * vvrr - vv * rr) / scatter,
               noise = std::max(0.0, (rr - late * vv) / n);  // variances
  if (!(late > 0)) return times;
  double unknown = 0;
  for (std::size_t i = 0; i < times.time.size(); ++i) {
    const std::size_t k = g.row[i];
    const double v = rate[k] * rate[k], known = v > 0 ? v * late / (v * late + noise) : 0;
    const double most = std::min(kMostLate * times.unsure, kWithin * interval);
    if (v > 0) times.time[i] += std::clamp(known * off[k] / rate[k], -most, most);
    unknown += v * (1 - known);
  }
  // The parabola follows what all its samples are late by, and of one sample alone the share `slow`.
  times.unsure *= std::sqrt(slow + (1 - slow) * unknown / std::max(vv, unknown));
  return times;
}

/// Samples are taken beside their rows by an error of their own, of which the stamps say a share: what
/// remains unknown has the variance share (1 - share) of that of the stamps.
SamplingTimes settled(const Record& record, const SampleGrid& g) {
  std::vector<double> off(g.time.size(), 0.0), even, times;
  // Without motion the stamps are what is known; without a position they jitter as others do.
  double squares = 0, error = 0,
         share = record.has(Channel::motor_position) || record.has(Channel::load_position);
  for (std::size_t i = 0; i < record.size(); ++i) {
    even.push_back(g.time[g.row[i]]);
    off[g.row[i]] = record.time[i] - even[i];
    squares += off[g.row[i]] * off[g.row[i]] / double(record.size());
  }
  for (int pass = 0; pass < kPasses; ++pass) {
    times = even;
    for (std::size_t i = 0; i < even.size(); ++i) times[i] += share * off[g.row[i]];
    Slope slope;
    for (const Channel channel : {Channel::motor_position, Channel::load_position})
      if (record.has(channel)) add_share(slope, g, off, at_rows(g, times, record.column(channel), true));
    if (!(slope.xx > 0)) break;
    share = std::clamp(share + slope.xy / slope.xx, 0.0, 1.0),
    error = kSureOff * kNeighbours / std::sqrt(slope.xx);
  }
  if (share < error) return {even, 0, 0};
  if (share > 1 - error) return {record.time, 1, 0};
  for (std::size_t i = 0; i < even.size(); ++i) times[i] = even[i] + share * off[g.row[i]];
  return by_motion(record, g, {times, share, std::sqrt(share * (1 - share) * squares)});
}

}  // namespace

SamplingTimes sampling_times(const Record& record, const std::vector<Stretch>& cuts) {
  const bool known = !std::isnan(record.unsure_time);
  if (known || record.size() < kOfCubic) return {record.time, 1, known ? record.unsure_time : 0};
  std::optional<SampleGrid> grid = grid_of(record.time, record.sampling_interval());
  if (!grid) return {record.time, 1, 0};
  if (grid->off < kEven) {
    SamplingTimes even;
    for (const std::size_t row : grid->row) even.time.push_back(grid->time[row]);
    return even;
  }
  for (std::size_t i = 0; i < record.size(); ++i)
    for (const Stretch& cut : cuts)
      if (record.time[i] >= cut.from && record.time[i] <= cut.to) grid->lost[grid->row[i]] = true;
  return settled(record, *grid);
}

}  // namespace backlash::record
