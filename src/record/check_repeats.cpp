// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/record/even_grid.h"
#include "backlash_diagnosis/record/numbers.h"
#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "check_parts.h"

namespace backlash::record {
namespace {

constexpr double kMoves = 2;      // theory: steps of the sensor per sample, at which no value repeats
constexpr double kMakesUp = 0.5;  // choice: of the way in as many samples again, that one step makes
constexpr double kRests = 3;      // choice: times the usual number of samples that a value lasts
constexpr double kHeld = 0.25;    // choice: share of samples; what rounds and rests shows up to 0.1
constexpr std::size_t kFewestMoving = 200;  // choice: samples of motion, to say a share
constexpr std::size_t kFewestLevels = 20;   // choice: values of a torque that is measured and not switched
constexpr double kTogether = 0.8;           // choice: share of new rows, of channels that come together
constexpr double kRegular = 0.8;            // choice: share of the values that last equally long
constexpr double kFarther = 3;              // choice: so much farther than elsewhere the other position goes
constexpr double kOutside = 0.1;            // choice: share of the record that must show how both move
constexpr double kRarest = 0.005;           // choice: share of outliers to either side
constexpr double kFewSteps = 20;            // choice: steps of the sensor
constexpr int kNoiseOrder = 3;              // theory: differences that leave nothing of a parabola

struct Run {
  std::size_t begin, end;  // one after the last
};

std::vector<Run> runs_of(const std::vector<double>& x, std::size_t least) {
  std::vector<Run> runs;
  for (std::size_t begin = 0; begin < x.size();) {
    std::size_t end = begin + 1;
    while (end < x.size() && x[end] == x[begin]) ++end;
    if (end - begin >= least) runs.push_back({begin, end});
    begin = end;
  }
  return runs;
}

/// Share of the samples in motion that repeat the one before. A value that was held is followed by a step
/// that makes up for it; one of a machine that stood still, by the first of a motion, and it lasts longer.
double held_while_moving(const std::vector<double>& x, double step) {
  std::vector<double> lengths, held;
  for (const Run& run : runs_of(x, 1)) {
    const std::size_t length = run.end - run.begin;
    if (run.end + length >= x.size()) break;
    const double next = std::fabs(x[run.end] - x[run.end - 1]);
    if (next <= kMoves * step || x[run.begin] == 0) continue;  // a speed of 0 is one of a machine at rest
    lengths.push_back(double(length));
    if (next >= kMakesUp * std::fabs(x[run.end + length] - x[run.end])) held.push_back(double(length));
  }
  if (lengths.empty()) return 0;
  const double fresh = double(lengths.size()), longest = kRests * signal::median(lengths);
  double repeated = 0;
  for (const double length : held)
    if (length <= longest) repeated += length - 1;
  return fresh + repeated < double(kFewestMoving) ? 0 : repeated / (fresh + repeated);
}

/// The same of a torque, whose values may well repeat where it is switched or rounded: held, each lasts
/// equally long.
double held_regularly(const std::vector<double>& x) {
  const std::vector<Run> runs = runs_of(x, 1);
  if (runs.size() < kFewestMoving) return 0;
  std::vector<double> lengths, values;
  for (const Run& run : runs) lengths.push_back(double(run.end - run.begin)), values.push_back(x[run.begin]);
  std::sort(values.begin(), values.end());
  const auto levels = std::size_t(std::unique(values.begin(), values.end()) - values.begin());
  const double usual = signal::median(lengths);
  const auto regular = std::count_if(lengths.begin(), lengths.end(),
                                     [&](double length) { return std::fabs(length - usual) <= 1; });
  if (levels < kFewestLevels || usual < 2 || double(regular) < kRegular * double(runs.size())) return 0;
  return 1 - double(runs.size()) / double(x.size());
}

/// Rows with a new value; where the value rests, one in each of `period` rows.
std::vector<bool> new_values(const std::vector<double>& x, double period) {
  const auto longest = std::size_t(std::lround(period));
  std::vector<bool> rows(x.size(), false);
  std::size_t since = longest;
  for (std::size_t i = 0; i < x.size(); ++i) {
    rows[i] = ++since >= longest || (i > 0 && x[i] != x[i - 1]);
    if (rows[i]) since = 0;
  }
  return rows;
}

/// Share of some rows that are also in others.
double shared(const std::vector<bool>& rows, const std::vector<bool>& others) {
  std::size_t count = 0, both = 0;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i]) ++count, both += others[i];
  return double(both) / double(count);
}

void look_at_held(RecordLook& look, ChannelState& state) {
  const std::vector<double>& x = look.record.column(state.channel);
  if (state.channel == Channel::reference_position) return;  // is set when it is set
  state.held = is_torque(state.channel) ? held_regularly(x) : held_while_moving(x, signal::smallest_step(x));
  if (state.held < kHeld) return;
  state.rate = (1 - state.held) / look.interval;
  const std::string& name = channel_name(state.channel);
  look.say(FindingKind::held_samples, name, look.record.time.front(), look.record.time.back(),
           std::size_t(std::lround(state.held * double(x.size()))), Consequence::noted,
           fmt::format("{}: {:.3g} % of the samples in motion repeat the value before: it has new values at "
                       "{:.4g} Hz, not "
                       "at {:.4g} Hz; what is faster than that is not in it",
                       name, 100 * state.held, state.rate, 1 / look.interval));
}

/// The held position with the fewest new values; null: none. A torque may be held by the drive itself, and is
/// then what it says all the time; a position is not.
const ChannelState* slowest_held(const std::vector<ChannelState>& channels) {
  const ChannelState* slowest = nullptr;
  for (const ChannelState& state : channels)
    if (state.held >= kHeld && is_smooth(state.channel) && (!slowest || state.held > slowest->held))
      slowest = &state;
  return slowest;
}

/// Rows of new values remain, where the other held channels are new in them too.
void leave_out_held(RecordLook& look) {
  const ChannelState* slowest = slowest_held(look.out.channels);
  if (!slowest || look.declared.shares_stamps) return;
  const std::vector<bool> rows = new_values(look.record.column(slowest->channel), 1 / (1 - slowest->held));
  for (const ChannelState& state : look.out.channels)
    if (state.held >= kHeld && (is_smooth(state.channel) || is_torque(state.channel)) &&
        shared(rows, new_values(look.record.column(state.channel), 1 / (1 - state.held))) < kTogether)
      return;
  keep_rows(look.record, rows);
  look.interval = look.record.sampling_interval();
  for (Finding& finding : look.out.findings) {
    if (finding.kind != FindingKind::held_samples || finding.channel != channel_name(slowest->channel))
      continue;
    finding.consequence = Consequence::mended;
    finding.message += "; only the rows with new values are used";
  }
}

struct Follow {
  double slope = 0, apart = 0;  // of x over y, and how far x leaves that line where nothing stands still
};

/// Over the samples outside of the long runs; `apart` < 0: too few of them.
Follow follow_of(const std::vector<double>& x, const std::vector<double>& y, const std::vector<Run>& runs) {
  std::vector<double> a, b;
  std::size_t next = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (next < runs.size() && i == runs[next].begin) {
      i = runs[next++].end - 1;
      continue;
    }
    a.push_back(x[i]), b.push_back(y[i]);
  }
  if (double(a.size()) < kOutside * double(x.size()) || a.size() < kFewestToCheck) return {0, -1};
  double mean_a = 0, mean_b = 0, along = 0, square = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    mean_a += a[i] / double(a.size()), mean_b += b[i] / double(a.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    along += (a[i] - mean_a) * (b[i] - mean_b), square += (b[i] - mean_b) * (b[i] - mean_b);
  if (!(square > 0)) return {0, -1};
  Follow follow{along / square, 0};
  for (std::size_t i = 0; i < a.size(); ++i) a[i] -= follow.slope * b[i];
  follow.apart = signal::quantile_range(a, kRarest);
  return follow;
}

/// x stands still while y, which it follows elsewhere, moves farther than the two are ever apart.
void look_at_frozen(RecordLook& look, Channel channel, const std::vector<double>& y,
                    const std::string& other) {
  const std::vector<double>& x = look.record.column(channel);
  const std::vector<Run> runs = runs_of(x, kLongRun);
  if (runs.empty()) return;
  const Follow follow = follow_of(x, y, runs);
  if (follow.apart < 0) return;
  const double step = signal::smallest_step(x);
  for (const Run& run : runs) {
    const double moves = signal::extent(y, run.begin, run.end).size();
    if (std::fabs(follow.slope) * moves > kFarther * follow.apart + kFewSteps * step)
      cut_frozen(look, channel, run.begin, run.end, fmt::format("while {} moves by {:.4g}", other, moves));
  }
}

/// A torque that is noisy elsewhere repeats a value that often only where it is limited or switched off.
void look_at_frozen_torque(RecordLook& look, const ChannelState& state) {
  const std::vector<double>& x = look.record.column(state.channel);
  if (!(state.noise > kMoves * signal::smallest_step(x))) return;
  for (const Run& run : runs_of(x, kLongRun)) {
    const double value = x[run.begin];
    if (value == 0 || value == state.low || value == state.high) continue;
    cut_frozen(look, state.channel, run.begin, run.end, "although it is noisy elsewhere");
  }
}

std::vector<double> travelled(const std::vector<double>& time, const std::vector<double>& speed) {
  std::vector<double> way(time.size(), 0.0);
  for (std::size_t i = 0; i + 1 < time.size(); ++i)
    way[i + 1] = way[i] + 0.5 * (speed[i] + speed[i + 1]) * (time[i + 1] - time[i]);
  return way;
}

}  // namespace

bool is_torque(Channel channel) {
  return channel == Channel::motor_torque || channel == Channel::sensor_torque ||
         channel == Channel::output_torque || channel == Channel::motor_current ||
         channel == Channel::acceleration;
}

void cut_frozen(RecordLook& look, Channel channel, std::size_t begin, std::size_t end,
                const std::string& while_what) {
  const std::vector<double>& t = look.record.time;
  for (const Stretch& cut : look.cuts)
    if (cut.from == t[begin] && cut.to > cut.from) return;
  const bool to_end = end == t.size();
  const std::string& name = channel_name(channel);
  look.say(
      FindingKind::frozen, name, t[begin], t[end - 1], end - begin, Consequence::cut,
      fmt::format("{}: stands still from {:.6g} s {} {}: its sensor or driver stopped; this part is not used",
                  name, t[begin], to_end ? "on" : fmt::format("to {:.6g} s", t[end - 1]), while_what));
  look.cuts.push_back({t[begin], to_end ? INFINITY : t[end]});
}

void check_repeats(RecordLook& look) {
  const Record& r = look.record;
  for (const Channel channel : kChannels) {
    const std::vector<double>& x = r.column(channel);
    if (x.empty()) continue;
    ChannelState state{channel, 1 / look.interval, 0, 0, 0, 0, 0};
    if (all_finite(x)) {
      const signal::Extent range = signal::extent(x);
      state.low = range.low, state.high = range.high;
      state.resolution = signal::smallest_step(x);
      state.noise = signal::noise_from_differences(x, kNoiseOrder);
      look_at_held(look, state);
      if (is_torque(channel) && channel != Channel::acceleration) look_at_frozen_torque(look, state);
    }
    look.out.channels.push_back(state);
  }
  leave_out_held(look);
  const std::vector<double>&motor = r.column(Channel::motor_position),
        &load = r.column(Channel::load_position), &speed = r.column(Channel::motor_velocity);
  if (motor.empty() || !all_finite(motor)) return;
  const std::size_t before = look.cuts.size();
  if (!load.empty() && all_finite(load)) {
    look_at_frozen(look, Channel::load_position, motor, "motor_position");
    look_at_frozen(look, Channel::motor_position, load, "load_position");
  }
  if (!speed.empty() && all_finite(speed) && look.cuts.size() == before)
    look_at_frozen(look, Channel::motor_position, travelled(r.time, speed), "the way by motor_velocity");
}

}  // namespace backlash::record
