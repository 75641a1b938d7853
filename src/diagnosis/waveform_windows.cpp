// SPDX-License-Identifier: BSD-3-Clause
#include "waveform_windows.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/order_statistics.h"
#include "refusal.h"

namespace backlash::diagnosis {
namespace {

constexpr double kLeadRings = 1.3;       // before the reversal: choice, tells the start
constexpr double kTailRings = 11.7;      // after it: choice, the motion has died out
constexpr double kShortestRings = 5;     // of a half period: choice, the first impacts are in it
constexpr double kSamplesPerRing = 3;    // fewest: choice, 2 are the least in theory
constexpr double kUneven = 0.02;         // of an interval, largest error of a stamp: choice
constexpr double kBetween = 0.5;         // of the level; what is below is on its way
constexpr double kTurned = 0.3;          // of the middle size of a smooth torque: choice
constexpr double kMostBetween = 0.05;    // share of samples: a sine has 0.23, noise of a fifth 0.006
constexpr double kLargestSpread = 0.25;  // of the level, standard deviation about it: choice; a sine has 0.3
constexpr double kSamePlace = 1.5;  // samples, of a reversal in two records: theory, one and its rounding
constexpr std::size_t kFewest = 4;  // windows: choice
constexpr double kSeen =
    0.9;  // share of a window's samples that were recorded: choice; the start before it: all

void check_even(const record::Record& record) {
  const double dt = record.sampling_interval();
  double least = 0, most = 0;
  for (std::size_t i = 0; i < record.size(); ++i) {
    const double off = record.time[i] - record.time[0] - static_cast<double>(i) * dt;
    least = std::min(least, off), most = std::max(most, off);
  }
  if (most - least > kUneven * dt * (1 + 0.01 * static_cast<double>(record.size())))
    throw Refusal{Status::out_of_domain, "the samples are not evenly spaced in time"};
}

struct Torque {
  double level[2];             // N m, backward and forward
  std::vector<int> reversals;  // first sample after each
  bool square = true;          // else its samples count
};

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
std::vector<int> turns(const std::vector<double>& torque, double least) {
  std::vector<int> found;
  int state = 0, last = 0;
  for (std::size_t i = 0; i < torque.size(); ++i) {
    const int now = torque[i] > least ? 1 : torque[i] < -least ? -1 : 0;
    if (now == 0) continue;
    if (state != 0 && now != state) found.push_back(last + 1);
    state = now, last = static_cast<int>(i);
  }
  return found;
}

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
    if (now != state) found.reversals.push_back(static_cast<int>(i));
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

/// Where each reversal was, in samples, from a line through them all: a steady period that is no whole number
/// of samples is then known more finely than one. A reversal beside a lost sample may be one off and is not
/// asked.
std::vector<double> steady(const std::vector<int>& reversals, const record::EvenGrid& even) {
  std::vector<std::size_t> asked;
  for (std::size_t k = 0; k < reversals.size(); ++k)
    if (even.whole(static_cast<std::size_t>(reversals[k]) - 1, 2)) asked.push_back(k);
  if (asked.size() < 2) return {reversals.begin(), reversals.end()};
  const auto n = static_cast<double>(asked.size());
  double sum = 0, mean = 0, slope = 0, squares = 0;
  for (const std::size_t k : asked) sum += static_cast<double>(k), mean += reversals[k] / n;
  const double middle = sum / n;
  for (const std::size_t k : asked) {
    const double x = static_cast<double>(k) - middle;
    slope += x * reversals[k], squares += x * x;
  }
  slope /= squares;
  std::vector<double> line;
  for (std::size_t k = 0; k < reversals.size(); ++k)
    line.push_back(mean + slope * (static_cast<double>(k) - middle));
  for (const std::size_t k : asked)
    if (std::fabs(line[k] - reversals[k]) > 0.75) return {reversals.begin(), reversals.end()};
  return line;
}

/// Those of `places` that are these reversals, or what these tell themselves.
std::vector<double> known_places(const std::vector<int>& reversals, const std::vector<double>& places,
                                 const record::EvenGrid& even) {
  std::vector<double> at;
  for (const int r : reversals)
    for (const double place : places)
      if (std::fabs(place - r) < kSamePlace) {
        at.push_back(place);
        break;
      }
  return at.size() == reversals.size() ? at : steady(reversals, even);
}

}  // namespace

std::vector<double> waveform_reversals(const record::EvenGrid& even) {
  return steady(torque_of(even.record.column(record::Channel::motor_torque)).reversals, even);
}

int waveform_lead(double ring, double interval) {
  return static_cast<int>(std::lround(kLeadRings * ring / interval));
}

int waveform_length(const WaveformWindow& window, double rings, double ring, double interval) {
  const int wanted = waveform_lead(ring, interval) + static_cast<int>(std::lround(rings * ring / interval));
  return std::min(window.samples, wanted);
}

std::vector<WaveformWindow> waveform_windows(const record::EvenGrid& even, double ring, int most, bool free,
                                             const std::vector<double>& places) {
  const record::Record& record = even.record;
  const double dt = record.sampling_interval();
  if (!(dt * kSamplesPerRing < ring))
    throw Refusal{Status::out_of_domain,
                  fmt::format("a sample each {:.3g} s does not resolve the ring of {:.3g} s", dt, ring)};
  check_even(record);
  const std::vector<double>& values = record.column(record::Channel::motor_torque);
  Torque torque = torque_of(values);
  const std::vector<double> turning =
      free ? averaged(record.column(record::Channel::sensor_torque), static_cast<std::size_t>(ring / dt))
           : values;
  if (!torque.square) torque.reversals = turns(turning, kTurned * middle_size(turning));
  if (torque.reversals.size() < kFewest)
    throw Refusal{Status::insufficient_data, "fewer than four reversals of the torque"};
  const std::vector<double> at =
      torque.square ? known_places(torque.reversals, places, even) : steady(torque.reversals, even);
  const int lead = waveform_lead(ring, dt), tail = static_cast<int>(std::lround(kTailRings * ring / dt));
  std::vector<WaveformWindow> all;
  std::vector<std::size_t> of;  // the reversals that they are about
  std::size_t broken = 0;       // windows that lack too much
  for (std::size_t k = 0; k < at.size(); ++k) {
    const int r = torque.reversals[k];
    const int end = k + 1 < at.size() ? torque.reversals[k + 1] : static_cast<int>(record.size());
    WaveformWindow w;
    w.first = r - lead;
    w.samples = std::min(lead + tail, end - w.first);
    if (w.first < 0 || w.samples < lead + kShortestRings * ring / dt) continue;
    const bool forward = torque.square ? values[static_cast<std::size_t>(r)] > 0
                                       : turning[static_cast<std::size_t>(r) - 1] < 0;
    w.side = forward ? -1 : 1;
    w.before = torque.level[!forward], w.after = torque.level[forward];
    w.reversal = (at[k] - w.first) * dt;
    if (!torque.square) w.drive.assign(values.begin() + w.first, values.begin() + w.first + w.samples);
    const auto first = static_cast<std::size_t>(w.first), samples = static_cast<std::size_t>(w.samples);
    if (!even.whole(first, static_cast<std::size_t>(lead) + 1) ||
        static_cast<double>(even.count(first, samples)) < kSeen * static_cast<double>(samples)) {
      ++broken;
      continue;
    }
    all.push_back(w), of.push_back(k);
  }
  if (all.size() + broken < kFewest)
    throw Refusal{Status::insufficient_data, "fewer than four reversals of the torque with time to settle"};
  std::vector<std::size_t> pairs;  // first windows of two reversals in a row, one to either side
  for (std::size_t k = 0; k + 1 < all.size(); ++k)
    if (of[k + 1] == of[k] + 1) pairs.push_back(k++);
  const std::size_t take = std::min(pairs.size(), static_cast<std::size_t>(most) / 2);
  if (2 * take < kFewest)
    throw Refusal{
        Status::insufficient_data,
        fmt::format(
            "of {} reversals of the torque {} have too many lost samples about them: two pairs are needed",
            all.size() + broken, broken)};
  std::vector<WaveformWindow> chosen;
  for (std::size_t i = 0; i < take; ++i) {
    const std::size_t k = pairs[i * pairs.size() / take];
    chosen.push_back(all[k]), chosen.push_back(all[k + 1]);
  }
  return chosen;
}

}  // namespace backlash::diagnosis
