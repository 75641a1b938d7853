// SPDX-License-Identifier: BSD-3-Clause
#include "waveform_windows.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/record/even_grid.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "refusal.h"

namespace backlash::diagnosis {
namespace {

constexpr double kLeadRings = 1.3;       // before the reversal: choice, shows the start
constexpr double kTailRings = 11.7;      // after it: choice, the motion has died out
constexpr double kShortestRings = 5;     // of a half period: choice, the first impacts are in it
constexpr double kSamplesPerRing = 2;    // fewest: theory (Nyquist)
constexpr double kBetween = 0.5;         // of the level; what is below is on its way
constexpr double kTurned = 0.3;          // of the middle size of a smooth torque: choice
constexpr double kMostBetween = 0.05;    // share of samples: a sine has 0.23, noise of a fifth 0.006
constexpr double kLargestSpread = 0.25;  // of the level, standard deviation about it: choice; a sine has 0.3
constexpr double kBeside = 0.25;         // samples, by which a steady reversal may lie beside its two: choice
constexpr std::size_t kFewest = 4;       // windows: choice
constexpr double kSeen = 0.5;            // of a window's samples, and of those before its reversal: choice

/// Mean over `reach` samples to either side, so that a tooth that rebounds does not count as a turn.
std::vector<double> averaged(const std::vector<double>& values, std::size_t reach) {
  std::vector<double> sums{0}, means;
  for (const double v : values) sums.push_back(sums.back() + v);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t first = i - std::min(i, reach), last = std::min(values.size(), i + reach + 1);
    means.push_back((sums[last] - sums[first]) / static_cast<double>(last - first));
  }
  return means;
}

/// Where a smooth torque turns: first sample that is no longer clearly on the side of before.
std::vector<std::size_t> turns(const std::vector<double>& torque, double least) {
  std::vector<std::size_t> found;
  int state = 0;
  std::size_t last = 0;
  for (std::size_t i = 0; i < torque.size(); ++i) {
    const int now = torque[i] > least ? 1 : torque[i] < -least ? -1 : 0;
    if (now == 0) continue;
    if (state != 0 && now != state) found.push_back(last + 1);
    state = now, last = i;
  }
  return found;
}

struct Torque {
  double level[2];                     // N m, backward and forward
  std::vector<std::size_t> reversals;  // first sample after each
  bool square = true;                  // else its samples count
};

Torque torque_of(const std::vector<double>& torque) {
  std::vector<double> half[2], size;
  for (const double t : torque) half[t > 0].push_back(t), size.push_back(std::fabs(t));
  if (half[0].size() < kFewest || half[1].size() < kFewest)
    throw Refusal{Status::insufficient_data, "the torque never reverses"};
  const double level = signal::median(size);
  Torque found{{signal::median(half[0]), signal::median(half[1])}, {}};
  int state = torque[0] > 0 ? 1 : 0;
  double between = 0, squares = 0;
  for (std::size_t i = 0; i < torque.size(); ++i) {
    const int now = torque[i] > kBetween * level ? 1 : torque[i] < -kBetween * level ? 0 : state;
    if (now != state) {  // it may have been on its way for some samples
      std::size_t first = i;
      while (first > 1 && (torque[first - 1] > 0) == (now == 1)) --first;
      found.reversals.push_back(first);
    }
    state = now;
    between += std::fabs(torque[i]) < kBetween * level;
    squares += std::pow(torque[i] - found.level[state], 2);
  }
  const auto count = static_cast<double>(torque.size());
  if (!(level > 0)) throw Refusal{Status::insufficient_data, "the torque never reverses"};
  found.square = between <= kMostBetween * count && std::sqrt(squares / count) <= kLargestSpread * level;
  return found;
}

double middle_size(const std::vector<double>& values) {
  std::vector<double> size;
  for (const double v : values) size.push_back(std::fabs(v));
  return signal::median(size);
}

/// When a square wave reverses, and how unsure that is.
struct Place {
  double time, unsure;
};

/// Between two samples; by a line through all of them where the period is steady.
std::vector<Place> places_of(const std::vector<std::size_t>& reversals, const std::vector<double>& time,
                             double interval) {
  std::vector<Place> places;
  double weights = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t k = 0; k < reversals.size(); ++k) {
    const double before = time[reversals[k] - 1], after = time[reversals[k]];
    places.push_back({(before + after) / 2, (after - before) / std::sqrt(12.0)});
    const double n = static_cast<double>(k), w = 1 / std::pow(places[k].unsure, 2),
                 t = places[k].time - time[0];
    weights += w, x += w * n, y += w * t, xx += w * n * n, xy += w * n * t;
  }
  if (places.size() < kFewest) return places;
  const double slope = (weights * xy - x * y) / (weights * xx - x * x), base = (y - slope * x) / weights;
  std::vector<Place> line;
  for (std::size_t k = 0; k < reversals.size(); ++k) {
    const double t = time[0] + base + slope * static_cast<double>(k), over = kBeside * interval;
    if (t < time[reversals[k] - 1] - over || t > time[reversals[k]] + over) return places;
    line.push_back({t, 0});
  }
  return line;
}

/// Pairs of windows about two reversals in a row, one to either side, spread evenly over the record.
std::vector<WaveformWindow> chosen(const std::vector<WaveformWindow>& all, const std::vector<std::size_t>& of,
                                   int most, std::size_t broken) {
  std::vector<std::size_t> pairs;
  for (std::size_t k = 0; k + 1 < all.size(); ++k)
    if (of[k + 1] == of[k] + 1) pairs.push_back(k++);
  const std::size_t take = std::min(pairs.size(), static_cast<std::size_t>(most) / 2);
  if (2 * take < kFewest)
    throw Refusal{
        Status::insufficient_data,
        fmt::format(
            "of {} reversals of the torque {} have too many lost samples about them: two pairs are needed",
            all.size() + broken, broken)};
  std::vector<WaveformWindow> some;
  for (std::size_t i = 0; i < take; ++i) {
    const std::size_t k = pairs[i * pairs.size() / take];
    some.push_back(all[k]), some.push_back(all[k + 1]);
  }
  return some;
}

std::vector<WaveformWindow> windows_of(const WaveformData& data, const Torque& torque,
                                       const std::vector<double>& turning, const WaveformCut& cut) {
  const std::vector<double>& time = data.time;
  std::vector<Place> at;
  if (torque.square)
    at = places_of(torque.reversals, time, data.interval);
  else
    for (const std::size_t r : torque.reversals) at.push_back({time[r], 0});
  std::vector<WaveformWindow> all;
  std::vector<std::size_t> of;  // the reversals that they are about
  std::size_t broken = 0;       // windows that lack too much
  for (std::size_t k = 0; k < at.size(); ++k) {
    const double start = at[k].time - kLeadRings * cut.ring;
    const double next = k + 1 < at.size() ? time[torque.reversals[k + 1] - 1] : time.back();
    const double end = std::min(at[k].time + kTailRings * cut.ring, next);
    if (start < std::max(cut.from, time[0]) || end > cut.to || end < at[k].time + kShortestRings * cut.ring)
      continue;
    WaveformWindow w;
    w.first = static_cast<std::size_t>(std::lower_bound(time.begin(), time.end(), start) - time.begin());
    w.reversal = at[k].time - time[w.first], w.unsure = at[k].unsure;
    double before = 0;
    for (std::size_t i = w.first; i < time.size() && time[i] <= end; ++i) {
      w.at.push_back(time[i] - time[w.first]);
      before += time[i] < at[k].time;
      if (!torque.square) w.drive.push_back(data.drive[i]);
    }
    if (before < std::max(2.0, kSeen * (at[k].time - start) / data.interval) ||
        static_cast<double>(w.at.size()) < kSeen * (end - start) / data.interval) {
      ++broken;
      continue;
    }
    const bool forward =
        torque.square ? data.drive[torque.reversals[k]] > 0 : turning[torque.reversals[k] - 1] < 0;
    w.side = forward ? -1 : 1;
    w.before = torque.level[!forward], w.after = torque.level[forward];
    all.push_back(w), of.push_back(k);
  }
  if (all.size() + broken < kFewest)
    throw Refusal{Status::insufficient_data, "fewer than four reversals of the torque with time to settle"};
  return chosen(all, of, cut.most, broken);
}

}  // namespace

std::size_t waveform_length(const WaveformWindow& window, double rings, double ring) {
  const double end = window.reversal + rings * ring;
  return static_cast<std::size_t>(std::upper_bound(window.at.begin(), window.at.end(), end) -
                                  window.at.begin());
}

WaveformData waveform_data(const record::Record& record, const WaveformCut& cut) {
  WaveformData data;
  data.time = record::sampling_times(record).time;
  data.interval = record.sampling_interval();
  if (!(data.interval * kSamplesPerRing < cut.ring))
    throw Refusal{
        Status::out_of_domain,
        fmt::format("a sample each {:.3g} s does not resolve the ring of {:.3g} s: {:.0f} Hz would do",
                    data.interval, cut.ring, std::ceil(kSamplesPerRing / cut.ring))};
  data.drive = record.column(record::Channel::motor_torque);
  data.torque = record.column(record::Channel::sensor_torque);
  data.position = record.column(record::Channel::motor_position);
  Torque torque = torque_of(data.drive);
  const std::vector<double> turning =
      cut.free ? averaged(data.torque, static_cast<std::size_t>(cut.ring / data.interval)) : data.drive;
  if (!torque.square) torque.reversals = turns(turning, kTurned * middle_size(turning));
  if (torque.reversals.size() < kFewest)
    throw Refusal{Status::insufficient_data, "fewer than four reversals of the torque"};
  data.square = torque.square;
  data.windows = windows_of(data, torque, turning, cut);
  for (const WaveformWindow& w : data.windows)
    data.level += (std::fabs(w.before) + std::fabs(w.after)) / 2 / static_cast<double>(data.windows.size());
  return data;
}

}  // namespace backlash::diagnosis
