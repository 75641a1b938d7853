// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

#include "backlash_diagnosis/record/numbers.h"
#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "check_parts.h"

namespace backlash::record {
namespace {

// A machine needs many samples to gain and lose speed; a step leaves the speed on both sides as it was. With
// the excess e[i] = x[i+1] - x[i] - interval (speed before + speed after) / 2, a step J gives -J/2, J, -J/2.
constexpr double kShape = 0.3;  // choice: of J, by which its neighbours may differ from that
constexpr double kStandsOut =
    10;                        // choice: so many times what the other samples show; measured records: below 4
constexpr double kRare = 500;  // choice: one of so many samples may be wrong
constexpr double kSpoils = 4;  // theory: values of the excess that one wild sample takes part in
constexpr std::size_t kFewest = 30;   // choice: of values that are left out when the others are looked at
constexpr double kSteps = 4;          // theory: steps of the sensor; rounding makes up to two
constexpr std::size_t kSoon = 5;      // choice: samples in which a motion that goes on is seen
constexpr std::size_t kShortest = 3;  // choice: samples that a wild value may last
constexpr double kReturns = 0.2;      // choice: of the step, by which the way back may differ
constexpr std::size_t kBeside =
    16;  // choice: samples on either side, over which play and deflection are smooth
constexpr std::size_t kSaidApart = 8;  // choice: jumps, of more only the number is said

std::vector<double> excess_of(const std::vector<double>& time, const std::vector<double>& x) {
  std::vector<double> excess(x.size(), 0.0);
  for (std::size_t i = 1; i + 2 < x.size(); ++i) {
    const double span = time[i + 1] - time[i], before = (x[i] - x[i - 1]) / (time[i] - time[i - 1]),
                 after = (x[i + 2] - x[i + 1]) / (time[i + 2] - time[i + 1]);
    excess[i] = x[i + 1] - x[i] - 0.5 * span * (before + after);
  }
  return excess;
}

/// What an acceleration makes over an interval grows with its square.
double longer(const RecordLook& look, std::size_t i) {
  const double times = std::max(1.0, (look.record.time[i + 1] - look.record.time[i]) / look.interval);
  return times * times;
}

double usual_size(const std::vector<double>& excess) {
  std::vector<double> sizes;
  sizes.reserve(excess.size());
  for (const double e : excess) sizes.push_back(std::fabs(e));
  const std::size_t leave = std::max(kFewest, std::size_t(kSpoils * double(sizes.size()) / kRare));
  const auto place = sizes.end() - std::ptrdiff_t(std::min(leave, sizes.size() - 1)) - 1;
  std::nth_element(sizes.begin(), place, sizes.end());
  return *place;
}

bool has_shape(const std::vector<double>& e, std::size_t i) {
  return i > 0 && i + 1 < e.size() && std::fabs(e[i - 1] + 0.5 * e[i]) < kShape * std::fabs(e[i]) &&
         std::fabs(e[i + 1] + 0.5 * e[i]) < kShape * std::fabs(e[i]);
}

/// Whether the two speeds before i, and the two after i + 1, are known: no speed leads over a gap.
bool has_speeds(const RecordLook& look, std::size_t i) {
  const std::vector<double>& t = look.record.time;
  const double gap = kGapFactor * look.interval;
  return i >= 2 && i + 3 < t.size() && t[i] - t[i - 2] < gap && t[i + 3] - t[i + 1] < gap;
}

/// The last of up to kShortest wild samples from i + 1 on, else i. Wild: the position
/// goes on behind them as before.
std::size_t end_of_wild(const std::vector<double>& x, const std::vector<double>& t, std::size_t i,
                        double least) {
  const double speed = (x[i] - x[i - 1]) / (t[i] - t[i - 1]);
  const auto off = [&](std::size_t k) { return x[k] - x[i] - speed * (t[k] - t[i]); };
  for (std::size_t end = i + 1; end <= i + kShortest && end + 1 < x.size(); ++end) {
    if (std::fabs(off(end)) < least) return i;
    if (std::fabs(off(end + 1)) < kReturns * std::fabs(off(end))) return end;
  }
  return i;
}

/// Of a jump between i and i + 1: how the two positions lie to each other, a step in a parabola; else the
/// excess.
signal::Measured size_of(const RecordLook& look, Channel channel, std::size_t i, signal::Measured excess) {
  const bool of_motor = channel == Channel::motor_position;
  const std::vector<double>&x = look.record.column(channel), &t = look.record.time,
        &other = look.record.column(of_motor ? Channel::load_position : Channel::motor_position);
  if (other.empty() || !all_finite(other) || i + 1 < kBeside || i + 1 + kBeside > x.size()) return excess;
  const double ratio = of_motor ? look.declared.axis_ratio : 1 / look.declared.axis_ratio;
  Eigen::MatrixXd a(2 * kBeside, 4);
  Eigen::VectorXd b(2 * kBeside);
  for (std::size_t k = 0; k < 2 * kBeside; ++k) {
    const std::size_t at = i + 1 + k - kBeside;
    const double since = (t[at] - t[i]) / (double(kBeside) * look.interval);
    a.row(Eigen::Index(k)) << (at > i ? 1 : 0), 1, since, since * since;
    b[Eigen::Index(k)] = x[at] - ratio * other[at];
  }
  const signal::Measured size = signal::fit_linear(a, b).parameter(0);
  return std::fabs(size.value - excess.value) < kShape * std::fabs(excess.value) ? size : excess;
}

void say_jumps(RecordLook& look, const std::vector<Jump>& jumps) {
  if (jumps.empty()) return;
  const std::string& name = channel_name(jumps.front().channel);
  if (jumps.size() > kSaidApart) {
    look.say(
        FindingKind::jump, name, jumps.front().before, jumps.back().after, jumps.size(), Consequence::cut,
        fmt::format(
            "{}: jumps {} times within one sample, the first by {:.4g} after {:.6g} s: a zero that moves, or "
            "counts that are lost; used is what lies between two jumps",
            name, jumps.size(), jumps.front().size.value, jumps.front().before));
    return;
  }
  for (const Jump& jump : jumps)
    look.say(
        FindingKind::jump, name, jump.before, jump.after, 1, Consequence::cut,
        fmt::format(
            "{}: jumps by {:.4g} within one sample after {:.6g} s, faster than all else in the record moves: "
            "a zero that moved, a clutch that slipped or counts that were lost; no estimate reaches across",
            name, jump.size.value, jump.before));
}

/// The value before a jump repeats for long, and behind it the position goes on at once: it moved all the
/// while. Where it begins to repeat, else i.
std::size_t begin_of_frozen(const std::vector<double>& x, std::size_t i, double quantum) {
  std::size_t begin = i;
  while (begin > 0 && x[begin - 1] == x[i]) --begin;
  const std::size_t later = std::min(i + 1 + kSoon, x.size() - 1);
  const bool goes_on = std::fabs(x[later] - x[i + 1]) > kSteps * quantum;
  return i + 1 - begin >= kLongRun && goes_on ? begin : i;
}

/// What stands out of what is usual.
double least_excess(const std::vector<double>& x, const std::vector<double>& excess) {
  return std::max(kStandsOut * usual_size(excess), kSteps * signal::smallest_step(x));
}

/// Whether the motor accelerates more than usual about the samples from `begin` to `end`.
class Felt {
 public:
  explicit Felt(const RecordLook& look)
      : excess_(excess_of(look.record.time, look.record.column(Channel::motor_position))),
        usual_(usual_size(excess_)) {}
  bool operator()(std::size_t begin, std::size_t end) const {
    const auto at = excess_.begin() + std::ptrdiff_t(begin) - 1,
               last = excess_.begin() + std::ptrdiff_t(std::min(end + 2, excess_.size()));
    return std::any_of(at, last, [&](double e) { return std::fabs(e) > usual_; });
  }

 private:
  std::vector<double> excess_;
  double usual_;
};

std::vector<std::size_t> wild_rows(const RecordLook& look, Channel channel) {
  const std::vector<double>&x = look.record.column(channel), &t = look.record.time;
  const std::vector<double> excess = excess_of(t, x);
  const double least = least_excess(x, excess);
  const auto felt = is_torque(channel) ? std::optional(Felt(look)) : std::nullopt;
  std::vector<std::size_t> wild;
  for (std::size_t i = 1; i + 2 < x.size(); ++i) {
    if (std::fabs(excess[i]) < least * longer(look, i)) continue;
    const std::size_t end = end_of_wild(x, t, i, least);
    if (end == i || (felt && (*felt)(i + 1, end))) continue;
    while (i < end) wild.push_back(++i);
    ++i;
  }
  return wild;
}

std::vector<Jump> jumps_of(RecordLook& look, Channel channel) {
  const std::vector<double>&x = look.record.column(channel), &t = look.record.time;
  const std::vector<double> excess = excess_of(t, x);
  const double usual = std::max(usual_size(excess), signal::smallest_step(x)),
               least = least_excess(x, excess);
  std::vector<Jump> jumps;
  for (std::size_t i = 1; i + 2 < x.size(); ++i) {
    if (std::fabs(excess[i]) < least * longer(look, i) || !has_shape(excess, i) || !has_speeds(look, i))
      continue;
    if (const std::size_t begin = begin_of_frozen(x, i, signal::smallest_step(x)); begin < i)
      cut_frozen(look, channel, begin, i + 1, fmt::format("and then jumps on by {:.4g}", excess[i]));
    else
      jumps.push_back({channel, t[i], t[i + 1], size_of(look, channel, i, {excess[i], usual})});
  }
  return jumps;
}

bool can_be_looked_at(const std::vector<double>& x) {
  return !x.empty() && all_finite(x);
}

void leave_out(RecordLook& look, Channel channel, const std::vector<std::size_t>& wild) {
  const std::string& name = channel_name(channel);
  const double first = look.record.time[wild.front()];
  look.say(
      FindingKind::jump, name, first, look.record.time[wild.back()], wild.size(), Consequence::mended,
      fmt::format("{}: {} off by far and back at once, the first at {:.6g} s: they count as lost samples",
                  name, counted(wild.size(), "sample"), first));
  for (const std::size_t row : wild) look.record.column(channel)[row] = std::nan("");
}

}  // namespace

/// Positions first: a torque is wild where the motor does not feel it.
void check_wild(RecordLook& look) {
  for (const bool torques : {false, true}) {
    if (torques && !can_be_looked_at(look.record.column(Channel::motor_position))) break;
    for (const Channel channel : kChannels) {
      const bool encoder = std::count(kEncoders.begin(), kEncoders.end(), channel) > 0;
      if (!(torques ? is_torque(channel) : encoder)) continue;
      if (!can_be_looked_at(look.record.column(channel))) continue;
      const std::vector<std::size_t> wild = wild_rows(look, channel);
      if (!wild.empty()) leave_out(look, channel, wild);
    }
    if (!look.declared.shares_stamps) keep_rows_with_numbers({&look.record});
  }
}

void check_steps(RecordLook& look) {
  for (const Channel channel : kEncoders) {
    if (!can_be_looked_at(look.record.column(channel))) continue;
    const std::vector<Jump> jumps = jumps_of(look, channel);
    say_jumps(look, jumps);
    for (const Jump& jump : jumps) look.cuts.push_back({jump.after, jump.after});
    look.out.jumps.insert(look.out.jumps.end(), jumps.begin(), jumps.end());
  }
}

}  // namespace backlash::record
