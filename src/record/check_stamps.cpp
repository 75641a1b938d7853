// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "backlash_diagnosis/record/even_grid.h"
#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "check_parts.h"

namespace backlash::record {
namespace {

constexpr double kJitters = 0.01;  // choice: of an interval, standard deviation worth a look at the motion
constexpr double kOnGrid = 0.5;    // theory: of an interval, beyond which a stamp is nearer to another row
constexpr double kSteady = 0.2;    // choice: of the speed, by which it may change across a step of the clock
constexpr double kClearMotion = 20;  // choice: steps of the sensor that a speed must pass to be one

/// The clock jumped between i and i + 1 by more than the motion did: the speed before and after, being the
/// same, covers the way in one interval.
bool is_clock_step(const RecordLook& look, std::size_t i) {
  const std::vector<double>& t = look.record.time;
  if (i < 3 || i + 4 >= t.size()) return false;
  const double extra = t[i + 1] - t[i] - look.interval;
  for (const Channel channel : kEncoders) {
    const std::vector<double>& x = look.record.column(channel);
    if (x.empty()) continue;
    const double before = (x[i] - x[i - 3]) / (t[i] - t[i - 3]),
                 after = (x[i + 4] - x[i + 1]) / (t[i + 4] - t[i + 1]), speed = 0.5 * (before + after);
    const double smallest =
        signal::smallest_step({x.begin() + std::ptrdiff_t(i) - 3, x.begin() + std::ptrdiff_t(i) + 5});
    if (std::fabs(before - after) > kSteady * std::fabs(speed) ||
        !(std::fabs(speed * extra) > kClearMotion * smallest))
      continue;
    if (std::fabs(x[i + 1] - x[i] - speed * look.interval) < kSteady * std::fabs(speed * extra)) return true;
  }
  return false;
}

struct Lost {
  std::size_t samples = 0, places = 0, most = 0, most_after = 0, first = 0, last = 0;
};

std::string describe(const Lost& lost, const std::vector<double>& time) {
  const std::string what = counted(lost.samples, "sample") + " missing ";
  if (lost.places == 1)
    return what + fmt::format("after {:.6g} s: estimates leave out what spans the place", time[lost.first]);
  return what +
         fmt::format(
             "in {} places, the first after {:.6g} s, the most ({}) after {:.6g} s: estimates leave out "
             "what spans a place",
             lost.places, time[lost.first], lost.most, time[lost.most_after]);
}

/// A cut begins and ends at samples, whose times move.
void move(double& at, const std::vector<double>& from, const std::vector<double>& to) {
  const auto sample = std::lower_bound(from.begin(), from.end(), at);
  if (sample != from.end() && *sample == at) at = to[std::size_t(sample - from.begin())];
}

}  // namespace

std::string counted(std::size_t count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

void check_stamps(RecordLook& look) {
  const std::vector<double>& time = look.record.time;
  const std::vector<std::size_t> rows = rows_of_samples(time, look.interval);
  Lost lost;
  for (const ClockStep& step : look.record.clock_steps) {
    look.say(
        FindingKind::clock_step, "time", step.time, step.time, 1, Consequence::cut,
        fmt::format("time: goes back by {:.4g} s: the clock was set, or recordings were joined; what follows "
                    "counts on from {:.6g} s, used is what lies on one side",
                    step.back, step.time));
    look.cuts.push_back({step.time, step.time});
  }
  const auto is_set_back = [&](double t) {
    return std::any_of(look.record.clock_steps.begin(), look.record.clock_steps.end(),
                       [t](const ClockStep& step) { return step.time == t; });
  };
  for (std::size_t i = 0; i + 1 < time.size(); ++i) {
    const std::size_t missing = rows[i + 1] - rows[i] - 1;
    if (missing == 0 || is_set_back(time[i + 1])) continue;
    if (is_clock_step(look, i)) {
      look.say(
          FindingKind::clock_step, "time", time[i], time[i + 1], 1, Consequence::cut,
          fmt::format(
              "time: jumps by {:.4g} s after {:.6g} s while the positions go on by one sample: the clock "
              "was set; used is what lies on one side",
              time[i + 1] - time[i] - look.interval, time[i]));
      look.cuts.push_back({time[i + 1], time[i + 1]});
      continue;
    }
    if (lost.places == 0) lost.first = i;
    lost.last = i;
    ++lost.places;
    lost.samples += missing;
    if (missing > lost.most) lost.most = missing, lost.most_after = i;
  }
  look.out.stamps.interval = look.interval;
  look.out.stamps.lost = lost.samples;
  look.out.stamps.repeated = look.record.repeated_stamps;
  if (lost.samples > 0)
    look.say(FindingKind::lost_samples, "time", time[lost.first], time[lost.last + 1], lost.samples,
             Consequence::noted, describe(lost, time));
  if (look.record.repeated_stamps > 0)
    look.say(FindingKind::repeated_stamps, "time", look.record.first_repeated_stamp,
             look.record.first_repeated_stamp, look.record.repeated_stamps, Consequence::mended,
             fmt::format("{} repeated, the first at {:.6g} s: the later samples are left out",
                         counted(look.record.repeated_stamps, "stamp"), look.record.first_repeated_stamp));
}

void check_jitter(RecordLook& look) {
  const std::vector<double> stamps = look.record.time;
  const std::vector<std::size_t> rows = rows_of_samples(stamps, look.interval);
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i + 1 < stamps.size(); ++i) {
    if (rows[i + 1] - rows[i] > 1) continue;
    squares += std::pow((stamps[i + 1] - stamps[i]) / look.interval - 1, 2);
    ++count;
  }
  look.out.stamps.jitter = count > 0 ? std::sqrt(squares / double(count)) : 0;
  const bool seen = std::any_of(kEncoders.begin(), kEncoders.end(),
                                [&](Channel channel) { return look.record.has(channel); });
  if (look.out.stamps.jitter < kJitters || !seen) return;
  SamplingTimes times = sampling_times(look.record, look.cuts);
  look.out.stamps.of_stamps_only = times.stamped < 0.5;
  look.out.stamps.unsure = times.unsure / look.interval;
  if (look.declared.shares_stamps) return;
  double moved = 0;
  for (std::size_t i = 0; i < stamps.size(); ++i)
    moved += std::pow(times.time[i] - stamps[i], 2) / double(stamps.size());
  if (std::sqrt(moved) > kOnGrid * look.interval) return;  // a clock that drifts: stamps stay as they are
  look.out.stamps.evened = times.stamped < 1;
  look.record.time = std::move(times.time);
  look.record.unsure_time = times.unsure;
  for (Stretch& cut : look.cuts)
    for (double* at : {&cut.from, &cut.to}) move(*at, stamps, look.record.time);
  for (Jump& jump : look.out.jumps)
    for (double* at : {&jump.before, &jump.after}) move(*at, stamps, look.record.time);
}

}  // namespace backlash::record
