// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/record/even_grid.h"
#include "backlash_diagnosis/record/motion_sense.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "check_parts.h"

namespace backlash::record {
namespace {

constexpr double kFollows = 0.9;     // choice: correlation of a speed with the slope of its position
constexpr double kOtherUnit = 2;     // choice: times; filters of a speed leave it within that
constexpr std::size_t kBlocks = 12;  // choice: parts of a record whose mean distance is looked at
constexpr double kDriftsBeyond = 3;  // choice: times as far as the positions are apart within a part
constexpr double kSteadily = 0.95;   // choice: correlation of that distance with time

struct Line {
  double slope = 0, correlation = 0;  // of y over x
};

Line line_of(const std::vector<double>& x, const std::vector<double>& y) {
  double mx = 0, my = 0, xx = 0, yy = 0, xy = 0;
  const auto n = double(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) mx += x[i] / n, my += y[i] / n;
  for (std::size_t i = 0; i < x.size(); ++i)
    xx += (x[i] - mx) * (x[i] - mx), yy += (y[i] - my) * (y[i] - my), xy += (x[i] - mx) * (y[i] - my);
  return xx > 0 && yy > 0 ? Line{xy / xx, xy / std::sqrt(xx * yy)} : Line{};
}

/// A column of speeds that moves as a position does.
void look_for_position(RecordLook& look, Channel speed) {
  const std::string& name = channel_name(speed);
  for (const Channel position : kEncoders) {
    const std::vector<double>& x = look.record.column(position);
    if (x.empty() || !all_finite(x)) continue;
    if (std::fabs(line_of(x, look.record.column(speed)).correlation) < kFollows) continue;
    look.say(FindingKind::swapped, name, look.record.time.front(), look.record.time.back(), x.size(),
             Consequence::refused,
             fmt::format("{}: moves as {} does, not as its slope: columns are in each other's place", name,
                         channel_name(position)));
    return;
  }
}

/// Compares a speed with the slope of its own position.
void look_at_speed(RecordLook& look, Channel speed, Channel position) {
  const std::vector<double>&v = look.record.column(speed), &x = look.record.column(position),
        &t = look.record.time;
  if (v.empty() || x.empty() || !all_finite(v) || !all_finite(x)) return;
  std::vector<double> slope, seen;
  for (std::size_t i = 1; i + 1 < x.size(); ++i)
    slope.push_back((x[i + 1] - x[i - 1]) / (t[i + 1] - t[i - 1])), seen.push_back(v[i]);
  const Line line = line_of(slope, seen);
  if (std::fabs(line.correlation) < kFollows) return look_for_position(look, speed);
  const std::string &name = channel_name(speed), &of = channel_name(position);
  if (line.slope < 0)
    look.say(FindingKind::sign, name, t.front(), t.back(), x.size(), Consequence::refused,
             fmt::format("{}: is {:.4g} times the slope of {}: the sign of one of them is wrong", name,
                         line.slope, of));
  else if (line.slope > kOtherUnit || line.slope < 1 / kOtherUnit)
    look.say(
        FindingKind::scale, name, t.front(), t.back(), x.size(), Consequence::refused,
        fmt::format(
            "{}: is {:.4g} times the slope of {}: one of them is in other units (57.3: degrees), or on the "
            "other side of the reduction",
            name, line.slope, of));
}

/// The positions come apart further, and more steadily, than play and deflection explain.
void look_at_drift(RecordLook& look) {
  const std::vector<double>&motor = look.record.column(Channel::motor_position),
        &load = look.record.column(Channel::load_position), &t = look.record.time;
  if (motor.empty() || load.empty() || !all_finite(motor) || !all_finite(load) || !look.cuts.empty()) return;
  const Line follows = line_of(load, motor);
  if (follows.correlation < kFollows) return;
  std::vector<double> middle, when, spread;
  const std::size_t size = motor.size() / kBlocks;
  for (std::size_t k = 0; k < kBlocks; ++k) {
    std::vector<double> apart;
    for (std::size_t i = k * size; i < (k + 1) * size; ++i)
      apart.push_back(motor[i] - follows.slope * load[i]);
    middle.push_back(signal::median(apart));
    spread.push_back(signal::peak_to_peak(apart));
    when.push_back(t[k * size + size / 2]);
  }
  const Line line = line_of(when, middle);
  const double drift = line.slope * (when.back() - when.front());
  if (std::fabs(line.correlation) < kSteadily || std::fabs(drift) < kDriftsBeyond * signal::median(spread))
    return;
  look.say(FindingKind::drift, "load_position", t.front(), t.back(), motor.size(), Consequence::noted,
           fmt::format("load_position: drifts against motor_position by {:.4g} over the record: a coupling "
                       "that creeps, or "
                       "an encoder that loses counts",
                       drift));
}

void look_at_motion(RecordLook& look) {
  const Stretch longest = longest_stretch(look.out);
  const EvenGrid even = even_grid(look.record.slice(longest.from, longest.to));
  const Record& r = even.record;
  const double ratio = look.declared.axis_ratio;
  std::vector<double> torque = r.column(Channel::motor_torque), motor = r.column(Channel::motor_position);
  const std::vector<double>& load = r.column(Channel::load_position);
  if (torque.empty() || motor.empty() || !all_finite(torque) || !all_finite(motor) || !all_finite(load))
    return;
  if (!(signal::peak_to_peak(torque) > 0) || !(signal::peak_to_peak(motor) > 0)) return;
  for (double& x : torque) x *= ratio;
  for (double& x : motor) x /= ratio;
  for (Finding& finding : sense_of({r.sampling_interval(), torque, motor, load}, look.declared)) {
    finding.from = r.time.front(), finding.to = r.time.back(), finding.count = r.size();
    if (!look.declared.known) finding.consequence = Consequence::noted;  // the signs and units are not said
    look.out.findings.push_back(std::move(finding));
  }
}

}  // namespace

void check_sense(RecordLook& look) {
  if (look.record.size() < kFewestToCheck) return;
  look_at_speed(look, Channel::motor_velocity, Channel::motor_position);
  look_at_speed(look, Channel::load_velocity, Channel::load_position);
  look_at_drift(look);
  look_at_motion(look);
}

}  // namespace backlash::record
