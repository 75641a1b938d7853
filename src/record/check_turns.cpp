// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/order_statistics.h"
#include "check_parts.h"

namespace backlash::record {
namespace {

constexpr double kWayOfTurn = 0.5;   // theory: of a turn, a longer way in one sample is shorter the other way
constexpr double kNearTurn = 0.05;   // choice: of the turn, by which the way in one sample may differ from it
constexpr double kWholeRange = 0.9;  // choice: of the range of a counter, which a step from end to end makes
constexpr double kInTurn = 3;        // choice: so many times farther to the next sample than to the one after
constexpr int kSources = 4;          // choice: samples of the faster of two sources between two of the slower
constexpr double kLost = 1.5;        // theory: intervals, half a sample more than to the next one
constexpr double kApart = 0.02;      // choice: of the range, by which two sources differ; ringing makes 0.003
constexpr double kFewestCounts = 64;     // choice: a counter of fewer steps is a sensor that hardly moves
constexpr std::size_t kFewestTurns = 2;  // theory: of a counter whose range is not known, there and back

std::vector<double> steps_over(const std::vector<double>& x, std::size_t lag) {
  std::vector<double> steps;
  for (std::size_t i = 0; i + lag < x.size(); ++i) steps.push_back(std::fabs(x[i + lag] - x[i]));
  return steps;
}

/// Motion goes twice as far in two samples as in one, noise just as far as in one. Two sources in turn go far
/// from one to the other and hardly anywhere within each.
bool of_two_sources(const std::vector<double>& x) {
  const double next = signal::median(steps_over(x, 1)), quantum = signal::smallest_step(x);
  if (!(next > std::max(kInTurn * quantum, kApart * signal::peak_to_peak(x)))) return false;
  for (int lag = 2; lag <= kSources; ++lag)
    if (next > kInTurn * std::max(signal::median(steps_over(x, std::size_t(lag))), quantum)) return true;
  return false;
}

/// Lengths of a turn by which a position may have been wrapped.
std::vector<double> known_turns(const RecordLook& look, Channel channel) {
  const double axis = channel == Channel::motor_position ? look.declared.axis_ratio : 1;
  std::vector<double> turns = {2 * M_PI * axis, 2 * M_PI, 360};
  if (channel == Channel::motor_position && look.declared.reduction_ratio > 0)
    turns.push_back(2 * M_PI * axis / look.declared.reduction_ratio);
  return turns;
}

struct Turns {
  double turn = 0;
  std::vector<std::size_t> after;  // samples
};

/// How far the motion goes from sample i to the next where samples between them are missing, at the mean of
/// the speeds before and after.
double moved_across(const RecordLook& look, const std::vector<double>& x, std::size_t i) {
  const std::vector<double>& t = look.record.time;
  const double span = t[i + 1] - t[i];
  if (span < kLost * look.interval || i == 0 || i + 2 >= x.size()) return 0;
  const auto speed = [&](std::size_t k) { return (x[k + 1] - x[k]) / (t[k + 1] - t[k]); };
  return 0.5 * (speed(i - 1) + speed(i + 1)) * span;
}

/// Steps of about one turn either way. What the position moves in one sample is far less than half a turn.
Turns turns_of(const RecordLook& look, const std::vector<double>& x, double turn) {
  Turns found{turn, {}};
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {
    const double way = std::fabs(x[i + 1] - x[i] - moved_across(look, x, i));
    if (way <= kWayOfTurn * turn) continue;
    if (std::fabs(way - turn) > kNearTurn * turn) return {turn, {}};
    found.after.push_back(i);
  }
  return found;
}

/// A counter of any range, as of 16 bits: steps from one end of the range to the other, and no others so far.
Turns turns_of_counter(const std::vector<double>& x) {
  const double range = signal::peak_to_peak(x);
  Turns found;
  if (range < kFewestCounts * signal::smallest_step(x)) return found;
  std::vector<double> sizes;
  for (std::size_t i = 1; i + 2 < x.size(); ++i) {
    const double way = x[i + 1] - x[i];
    if (std::fabs(way) <= kWholeRange * range) continue;
    const double moves = 0.5 * (x[i] - x[i - 1] + x[i + 2] - x[i + 1]);
    if (std::fabs(moves) > kNearTurn * range) continue;
    found.after.push_back(i);
    sizes.push_back(std::fabs(way - moves));
  }
  if (found.after.size() < kFewestTurns) return {};
  found.turn = signal::median(sizes);
  for (const double size : sizes)
    if (std::fabs(size - found.turn) > kNearTurn * found.turn) return {};
  return found;
}

void unwrap(RecordLook& look, Channel channel, const Turns& turns) {
  std::vector<double>& x = look.record.column(channel);
  const std::string& name = channel_name(channel);
  const double first = look.record.time[turns.after.front()], last = look.record.time[turns.after.back() + 1];
  look.say(
      FindingKind::wrapped, name, first, last, turns.after.size(), Consequence::mended,
      fmt::format(
          "{}: jumps by a turn of {:.4g} {}, the first after {:.6g} s: it was taken modulo a turn, and is "
          "unwrapped here",
          name, turns.turn, counted(turns.after.size(), "time"), first));
  double add = 0;
  auto next = turns.after.begin();
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {
    if (next != turns.after.end() && *next == i) {
      add += x[i + 1] + add > x[i] ? -turns.turn : turns.turn;
      ++next;
    }
    x[i + 1] += add;
  }
}

}  // namespace

void check_turns(RecordLook& look) {
  for (const Channel channel : kEncoders) {
    const std::vector<double>& x = look.record.column(channel);
    if (x.empty() || !all_finite(x) || !(signal::peak_to_peak(x) > 0)) continue;
    const std::string& name = channel_name(channel);
    if (of_two_sources(x)) {
      look.say(
          FindingKind::two_publishers, name, look.record.time.front(), look.record.time.back(), x.size(),
          Consequence::refused,
          fmt::format(
              "{}: two sources in turn, {:.4g} rad apart: two nodes publish this joint; record one of them "
              "only",
              name, signal::median(steps_over(x, 1))));
      continue;
    }
    Turns turns;
    for (const double turn : known_turns(look, channel))
      if (turns.after.empty()) turns = turns_of(look, x, turn);
    if (turns.after.empty()) turns = turns_of_counter(x);
    if (!turns.after.empty()) unwrap(look, channel, turns);
  }
}

}  // namespace backlash::record
