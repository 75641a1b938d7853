// SPDX-License-Identifier: BSD-3-Clause
#include "traverse_data.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/record/even_grid.h"
#include "backlash_diagnosis/signal/local_parabola.h"
#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "refusal.h"

namespace backlash::diagnosis {
namespace {

// All choices, tried on simulated machines, but where another origin is given.
constexpr double kCycleSamples = 4;        // fewest samples in a cycle of the motor against the load
constexpr double kCycleSamplesByLoad = 2;  // theory, Nyquist: the load's encoder shows the motion
constexpr double kStep = 0.2;              // of the integration times the fastest frequency, rad
constexpr double kBefore = 0.8;       // cycles of a window before a crossing, at least: they show the start
constexpr double kLongestBefore = 3;  // the same at most
constexpr double kAfter = 2.6;        // and from its begin on: the first touches, at least
constexpr double kTouches = 1.6;      // the same, from the end of a crossing on
constexpr double kMostTurns = 0.8;    // share of the crossings that fit into a window so long
constexpr double kLongest = 12;       // cycles, after the begin of a crossing
constexpr double kCounted = 0.5;      // share of a window in which the motor moves
constexpr double kUneven = 0.25;      // of an interval, from one sample to the next
constexpr double kClear = 4.4;        // noises of the averaged torque, above which it presses a flank
constexpr double kAveraged = 0.16;    // cycles, half width of the average
constexpr double kSlow = 0.02;        // of the rms speed: there dry friction takes any value
constexpr double kFade = 0.01;        // of it: the load's friction turns its sign within
constexpr std::size_t kFewestSamples = 256;
constexpr double kEnd = 0.02;    // share of the samples at either end of a range, of which outliers may be
constexpr double kShown = 5e-5;  // rad, of an encoder, beside its eccentricity: 10 seconds of arc
constexpr double kOffInTime =
    0.05;  // of the range of motor minus load position, as the rms joint moves: choice
constexpr double kUntracked = 0.1;           // of the usual torque, on the load
constexpr double kRough = 0.1, kFaster = 4;  // of the range; times the rate, that would show more
constexpr double kTile = 6;                  // cycles, of a window with the load's encoder
constexpr std::size_t kFewestTile = 48;      // samples, of it
constexpr std::size_t kFirst = 3;            // samples, that differences and delays need

/// What the weights leave of the noise of a torque of which two samples are averaged, and of second
/// differences of positions [N m].
double noise_of(const std::vector<double>& weights, double torque, double differences) {
  double squares = 0;
  const auto at = [&](std::ptrdiff_t i) {
    return i < 0 || i >= std::ptrdiff_t(weights.size()) ? 0 : weights[std::size_t(i)];
  };
  for (std::ptrdiff_t i = -1; i <= std::ptrdiff_t(weights.size()); ++i)
    squares += std::pow(0.5 * torque * (at(i) + at(i - 1)), 2) +
               std::pow(differences * (at(i - 1) - 2 * at(i) + at(i + 1)), 2);
  return std::sqrt(squares);
}

double cycle_of(const GapTraverseSettings& s) {
  return 2 * M_PI / std::sqrt(s.flank.stiffness * (1 / s.motor_inertia + 1 / s.load_inertia));
}

void check_samples(const record::Record& record, double interval, double cycle, double fewest) {
  if (record.size() < kFewestSamples) throw Refusal{Status::insufficient_data, "fewer than 256 samples"};
  if (!(interval * fewest < cycle))
    throw Refusal{Status::out_of_domain,
                  fmt::format("a sample each {:.3g} s does not resolve the cycle of {:.3g} s of the motor "
                              "against the load",
                              interval, cycle)};
  for (std::size_t i = 1; i < record.size(); ++i) {
    const double step = record.time[i] - record.time[i - 1];
    if (std::fabs(step - interval) > kUneven * interval)
      throw Refusal{Status::out_of_domain,
                    fmt::format("the samples are not evenly spaced in time at {:.6g} s", record.time[i])};
  }
}

/// What the motor leaves for the teeth.
std::vector<double> torque_of_teeth(const TraverseData& d, const TraverseMotor& motor) {
  std::vector<double> teeth(d.torque.size(), 0.0);
  for (std::size_t i = 1; i + 1 < teeth.size(); ++i)
    teeth[i] = 0.5 * (d.torque[i] + d.torque[i - 1]) - motor.inertia * d.acceleration[i] -
               motor.damping * d.rate[i] - std::copysign(motor.friction, d.rate[i]);
  return teeth;
}

std::size_t reach_of(const TraverseData& d, double cycle) {
  return std::max<std::size_t>(2, std::size_t(std::lround(kAveraged * cycle / d.interval)));
}

/// Of each sample: the averaged torque through the teeth, the flank that it presses (0: not clear which), and
/// for sure: whatever is wrong with the motor, while it moves, as far as the average reaches.
struct Presses {
  std::vector<double> torque;
  std::vector<int> flank, sure;
};

Presses presses_of(TraverseData& d, const std::vector<double>& teeth, const signal::LocalParabola& quadratic,
                   double unsure) {
  const std::size_t n = teeth.size(), reach = quadratic.reach;
  Presses p{std::vector<double>(n, 0.0), std::vector<int>(n, 0), std::vector<int>(n, 0)};
  const double clear = kClear * d.noise;
  std::vector<double> pressed;
  for (std::size_t i = reach + 1; i + reach + 1 < n; ++i) {
    p.torque[i] = quadratic.of(teeth, i, quadratic.value);
    if (!d.counts[i] || std::fabs(p.torque[i]) < clear) continue;  // at rest dry friction takes any value
    p.flank[i] = p.torque[i] > 0 ? 1 : -1;
    pressed.push_back(std::fabs(p.torque[i]));
  }
  d.clear = clear + unsure;
  if (!pressed.empty()) d.level = signal::median(pressed);
  for (std::size_t i = kFirst + 2 * reach; i + 2 * reach < n; ++i)
    if (d.counts[i] && std::fabs(p.torque[i]) > d.clear && p.flank[i - reach] == p.flank[i] &&
        p.flank[i + reach] == p.flank[i])
      p.sure[i] = p.flank[i];
  return p;
}

/// Last sample on a flank, and the first on the other one.
struct Turn {
  std::size_t left, touched;
};

std::vector<Turn> turns_of(const std::vector<int>& flank) {
  std::vector<Turn> turns;
  std::size_t last = 0;
  for (std::size_t i = kFirst; i < flank.size(); ++i) {
    if (flank[i] == 0) continue;
    if (last > 0 && flank[last] != flank[i]) turns.push_back({last, i});
    last = i;
  }
  return turns;
}

/// Of a window before the begin of a crossing: since its flank was last pressed for sure, of most crossings.
std::size_t samples_before(const std::vector<Turn>& turns, const Presses& presses, double cycle) {
  const auto longest = std::size_t(std::lround(kLongestBefore * cycle));
  std::vector<double> since;
  for (const Turn& turn : turns)
    for (std::size_t i = 0; i <= std::min(longest, turn.left); ++i) {
      if (presses.flank[turn.left - i] == -presses.flank[turn.left]) break;
      if (presses.sure[turn.left - i] == 0) continue;
      since.push_back(double(i));
      break;
    }
  const double most = since.empty() ? 0 : signal::quantile(since, kMostTurns);
  return std::size_t(std::lround(std::max(most, kBefore * cycle)));
}

/// Of a window from the begin of a crossing on: the first touches, of most crossings. Those that are left out
/// because they take longer would be those of the larger play.
std::size_t samples_after(const std::vector<Turn>& turns, double cycle) {
  std::vector<double> took;
  for (const Turn& turn : turns) took.push_back(double(turn.touched - turn.left));
  const double most = took.empty() ? 0 : signal::quantile(took, kMostTurns);
  return std::size_t(std::lround(std::clamp(most + kTouches * cycle, kAfter * cycle, kLongest * cycle)));
}

/// The earliest sample at most `before` before a crossing that presses its flank for sure; its begin where
/// there is none.
std::size_t first_of_window(const Turn& turn, const Presses& presses, std::size_t before) {
  const int flank = presses.flank[turn.left];
  std::size_t first = turn.left;
  while (first > 0 && turn.left - first < before && presses.flank[first - 1] != -flank) --first;
  while (first < turn.left && presses.sure[first] != flank) ++first;
  return first;
}

/// How many crossings lie in a window from flank to flank.
std::size_t count_within(const std::vector<Turn>& turns, const TraverseData& d) {
  return std::size_t(std::count_if(turns.begin(), turns.end(), [&](const Turn& turn) {
    return std::any_of(d.windows.begin(), d.windows.end(), [&](const TraverseWindow& w) {
      return w.first <= turn.left && turn.touched < w.first + d.samples;
    });
  }));
}

void find_windows(TraverseData& d, const std::vector<double>& teeth, double cycle, double unsure) {
  const signal::LocalParabola quadratic(reach_of(d, cycle));
  const Presses presses = presses_of(d, teeth, quadratic, unsure);
  const std::vector<Turn> turns = turns_of(presses.flank);
  d.crossings = turns.size();
  const std::size_t before = samples_before(turns, presses, cycle / d.interval);
  d.samples = before + samples_after(turns, cycle / d.interval);
  std::size_t free_from = kFirst;  // where the next window may begin
  for (const Turn& turn : turns) {
    const std::size_t first = first_of_window(turn, presses, before);
    if (first < free_from || presses.sure[first] == 0 ||
        first + d.samples + quadratic.reach + 1 >= teeth.size() ||
        turn.touched + d.samples / 8 > first + d.samples)
      continue;
    const auto from = d.counts.begin() + std::ptrdiff_t(first), to = from + std::ptrdiff_t(d.samples);
    if (double(std::count(from, to, 1)) < kCounted * double(d.samples)) continue;
    TraverseWindow w;
    w.first = first, w.side = presses.flank[first], w.torque = presses.torque[first];
    w.torque_rate = quadratic.of(teeth, first, quadratic.slope) / d.interval;
    d.windows.push_back(w);
    free_from = first + d.samples / 2;
  }
  d.within = count_within(turns, d);
}

Refusal unsure_times(double time, double place) {
  return {Status::out_of_domain,
          fmt::format(
              "the stamps jitter, and when the samples were taken is known to {:.2g} s, in which the joint "
              "moves by {:.2g} rad: stamps of the sampling, or even samples, would do",
              time, place)};
}

/// The motor's motion.
TraverseData motor_of(const record::EvenGrid& even, const GapTraverseSettings& settings, double fewest) {
  const record::Record& record = even.record;
  TraverseData d;
  d.interval = record.sampling_interval();
  const double cycle = cycle_of(settings);
  check_samples(record, d.interval, cycle, fewest);
  d.steps = std::max(1, static_cast<int>(std::ceil(2 * M_PI * d.interval / (cycle * kStep))));
  d.position = record.column(record::Channel::motor_position);
  const std::size_t n = d.position.size();
  d.rate.assign(n, 0), d.acceleration.assign(n, 0), d.counts.assign(n, 0);
  double squares = 0;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    d.rate[i] = (d.position[i + 1] - d.position[i - 1]) / (2 * d.interval);
    d.acceleration[i] =
        (d.position[i + 1] - 2 * d.position[i] + d.position[i - 1]) / (d.interval * d.interval);
    squares += d.rate[i] * d.rate[i] / static_cast<double>(n);
  }
  if (!(squares > 0)) throw Refusal{Status::insufficient_data, "the motor does not move"};
  d.slow = kFade * std::sqrt(squares);
  if (record.unsure_time > 0) d.unsure_place = record.unsure_time * std::sqrt(squares);
  for (std::size_t i = 0; i < n; ++i)  // beside a lost sample the differences are not measured
    d.counts[i] = std::fabs(d.rate[i]) > kSlow * std::sqrt(squares) &&
                  even.whole(i - std::min<std::size_t>(i, 1), std::min<std::size_t>(3, n - i + (i > 0)));
  d.position_noise = std::max(signal::noise_from_differences(d.position, 4),
                              signal::smallest_step(d.position) / std::sqrt(12.0));
  return d;
}

/// Rate of the load by a quadratic, and how much the record says of the torque that moves it.
void read_load(TraverseData& d, const record::EvenGrid& even, const GapTraverseSettings& settings,
               const signal::LocalParabola& quadratic, std::vector<double>& rate) {
  d.load = even.record.column(record::Channel::load_position);
  const std::size_t n = d.load.size(), reach = quadratic.reach;
  std::vector<double> apart(n);
  for (std::size_t i = 0; i < n; ++i) apart[i] = d.position[i] - d.load[i];
  const double low = signal::quantile(apart, kEnd), high = signal::quantile(apart, 1 - kEnd);
  const double middle = 0.5 * (low + high);
  d.width = high - low;
  if (!(signal::peak_to_peak(d.load) > 0) || !(d.width > 0))
    throw Refusal{Status::insufficient_data, d.width > 0 ? "load_position stands still"
                                                         : "motor_position and load_position are one signal"};
  // From every other sample the ones between follow by a cubic, where the motion is resolved.
  std::vector<double> left;
  for (std::size_t i = 3; i + 3 < n; ++i)
    left.push_back(
        std::fabs(apart[i] - (9 * (apart[i - 1] + apart[i + 1]) - apart[i - 3] - apart[i + 3]) / 16));
  if (const double rough = signal::median(left); rough > kRough * d.width)
    throw Refusal{Status::out_of_domain,
                  fmt::format("motor minus load position changes from sample to sample, half of the time by "
                              "more than {:.2g} rad "
                              "of a range of {:.2g}: a rate of {:.0f} Hz and more would show how",
                              rough, d.width, kFaster / d.interval)};
  if (d.unsure_place > kOffInTime * d.width) throw unsure_times(even.record.unsure_time, d.unsure_place);
  for (double& q : d.load) q += middle;
  d.load_counts.assign(n, 0);
  for (const double q : d.position) d.sine.push_back(std::sin(q)), d.cosine.push_back(std::cos(q));
  for (std::size_t i = 0; i < n; ++i) d.load_counts[i] = !even.lost[i];
  d.load_noise =
      std::max(signal::noise_from_differences(d.load, 4), signal::smallest_step(d.load) / std::sqrt(12.0));
  double weights = 0;
  for (const double w : quadratic.slope) weights += w * w;
  d.load_rate_noise = d.load_noise * std::sqrt(weights) / d.interval;
  rate.assign(n, 0);
  for (std::size_t i = reach; i + reach < n; ++i)
    rate[i] = quadratic.of(d.load, i, quadratic.slope) / d.interval;
  double squares = 0, count = 0;
  for (std::size_t i = 2 * reach; i + 2 * reach < n; ++i) {
    if (!d.counts[i]) continue;
    const double acceleration = (rate[i + reach] - rate[i - reach]) / (2 * double(reach) * d.interval);
    const double declared = settings.load_torque ? settings.load_torque(d.position[i]) : 0;
    squares += std::pow(settings.load_inertia * acceleration + declared, 2), ++count;
  }
  d.level = std::sqrt(squares / std::max(1.0, count));
}

}  // namespace

TraverseData traverse_data_by_load(const record::Record& recorded, const GapTraverseSettings& settings) {
  const record::EvenGrid even = record::even_grid(recorded);
  TraverseData d = motor_of(even, settings, kCycleSamplesByLoad);
  const double cycle = cycle_of(settings) / d.interval;
  const signal::LocalParabola quadratic(std::max<std::size_t>(3, reach_of(d, cycle_of(settings))));
  std::vector<double> rate;
  read_load(d, even, settings, quadratic, rate);
  d.samples = std::max<std::size_t>(kFewestTile, std::size_t(std::lround(kTile * cycle)));
  std::vector<double> widths;
  for (std::size_t first = quadratic.reach; first + d.samples + quadratic.reach < d.load.size();
       first += d.samples) {
    const auto from = d.counts.begin() + std::ptrdiff_t(first), to = from + std::ptrdiff_t(d.samples);
    if (double(std::count(from, to, 1)) < kCounted * double(d.samples)) continue;
    std::vector<double> apart;
    for (std::size_t i = first; i < first + d.samples; ++i) apart.push_back(d.position[i] - d.load[i]);
    const double low = signal::quantile(apart, kEnd), high = signal::quantile(apart, 1 - kEnd);
    widths.push_back(high - low);
    TraverseWindow w;
    w.first = first, w.load = d.load[first], w.load_rate = rate[first], w.width = high - low;
    if (settings.load_torque) w.load_torque = settings.load_torque(d.position[first + d.samples / 2]);
    d.windows.push_back(w);
  }
  if (d.windows.empty()) throw Refusal{Status::insufficient_data, "the motor hardly moves"};
  d.window_width = signal::quantile(widths, 0.9);
  d.shown_spread = std::max(2 * d.load_noise, kShown);
  d.load_torque_spread = kUntracked * d.level;
  return d;
}

void add_waves(TraverseData& d, const std::vector<double>& orders) {
  for (std::size_t n = 0; n < orders.size() && 2 * n + 1 < std::size_t(kTorqueWaves); ++n)
    for (const double q : d.position) {
      d.waves[2 * n].push_back(std::sin(orders[n] * q));
      d.waves[2 * n + 1].push_back(std::cos(orders[n] * q));
    }
}

TraverseData traverse_data(const record::Record& recorded, const GapTraverseSettings& settings,
                           const TraverseMotor& motor) {
  const record::EvenGrid even = record::even_grid(recorded);
  TraverseData d = motor_of(even, settings, kCycleSamples);
  d.torque = even.record.column(record::Channel::motor_torque);
  if (settings.motor_torque)
    for (std::size_t i = 0; i < d.torque.size(); ++i) d.torque[i] -= settings.motor_torque(d.position[i]);
  const double cycle = cycle_of(settings);
  const std::vector<double> teeth = torque_of_teeth(d, motor);
  d.torque_noise = signal::noise_from_differences(d.torque, 2);
  const signal::LocalParabola quadratic(reach_of(d, cycle));
  const double differences = motor.inertia * d.position_noise / (d.interval * d.interval);
  d.noise = noise_of(quadratic.value, d.torque_noise, differences);
  d.slope_noise = noise_of(quadratic.slope, d.torque_noise, differences) / d.interval;
  find_windows(d, teeth, cycle, motor.unsure);
  // Second differences have sqrt(6) times the noise of a sample.
  if (std::sqrt(6) * motor.inertia * d.unsure_place / (d.interval * d.interval) > d.level)
    throw unsure_times(even.record.unsure_time, d.unsure_place);
  if (settings.load_torque)
    for (TraverseWindow& w : d.windows)
      w.load_torque = settings.load_torque(d.position[w.first + d.samples / 2]);
  return d;
}

}  // namespace backlash::diagnosis
