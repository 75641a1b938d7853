// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/record/numbers.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "check_parts.h"

namespace backlash::record {
namespace {

constexpr double kRounding = 1e-12;  // theory: of a value that was divided by the ratio and written as text

double travel_of(const Record& record, Channel channel) {
  double low = INFINITY, high = -INFINITY;
  for (const double x : record.column(channel))
    if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
  return high > low ? high - low : 0;
}

bool turns_round(const std::vector<double>& position) {
  bool forward = false, backward = false;
  for (std::size_t i = 0; i + 1 < position.size(); ++i) {
    forward = forward || position[i + 1] > position[i];
    backward = backward || position[i + 1] < position[i];
  }
  return forward && backward;
}

void look_for_numbers(RecordLook& look, Channel channel) {
  const std::vector<double>& x = look.record.column(channel);
  std::size_t count = 0, first = 0, last = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (std::isfinite(x[i])) continue;
    if (count++ == 0) first = i;
    last = i;
  }
  if (count == 0) return;
  const std::string& name = channel_name(channel);
  look.say(FindingKind::not_finite, name, look.record.time[first], look.record.time[last], count,
           Consequence::mended,
           fmt::format("{}: no number in {}, the first at {:.6g} s: {}", name, counted(count, "sample"),
                       look.record.time[first],
                       double(x.size() - count) < kHardlyRecorded * double(x.size())
                           ? "taken as absent"
                           : "they count as lost samples"));
}

void drop(RecordLook& look, Channel channel) {
  look.record.column(channel).clear();
}

/// rad at the load: the farthest that one side moves while the other stands.
double loosest(const RecordLook& look) {
  if (!look.declared.looseness) return 0;
  return kLooserThanDeclared *
         look.declared.looseness(look.declared.axis_ratio * travel_of(look.record, Channel::motor_torque));
}

/// The channel has one value throughout. What follows depends on the other channels.
void say_dead(RecordLook& look, Channel channel) {
  const Record& r = look.record;
  const double value = r.column(channel).front() + 0.0, motor = travel_of(r, Channel::motor_position);
  const std::string& name = channel_name(channel);
  const std::string still = fmt::format("{}: is {:.4g} throughout", name, value);
  const auto say = [&](Consequence consequence, const std::string& means) {
    look.say(FindingKind::dead, name, r.time.front(), r.time.back(), r.size(), consequence, still + means);
  };
  const bool alone = !look.declared.may_hold_load;
  switch (channel) {
    case Channel::reference_position:
      return;  // a target that stays
    case Channel::motor_torque:
    case Channel::motor_current:
      if (!(motor > 0) || (value != 0 && !turns_round(r.column(Channel::motor_position)))) return;
      return say(
          alone && (channel == Channel::motor_torque || !r.has(Channel::motor_torque)) ? Consequence::refused
                                                                                       : Consequence::noted,
          fmt::format(
              " while motor_position moves by {:.4g}: no torque was recorded; publish the effort, or name "
              "the channel that has it",
              motor));
    case Channel::motor_position: {
      const bool moves =
          travel_of(r, Channel::load_position) > loosest(look) || travel_of(r, Channel::motor_velocity) > 0;
      if (!moves) return say(Consequence::noted, ": the motor rests, or its position was not recorded");
      return say(alone && look.declared.free_load ? Consequence::refused : Consequence::noted,
                 " while the load, or motor_velocity, moves: the position of the motor was not recorded");
    }
    case Channel::load_position: {
      if (!look.declared.free_load && look.declared.known) return;  // a locked output
      if (!(motor / look.declared.axis_ratio > loosest(look))) return;
      if (!look.declared.known || !alone)
        return say(Consequence::noted,
                   fmt::format(" while motor_position moves by {:.4g}: the output is locked or taken "
                               "off, or its position was not recorded",
                               motor));
      say(Consequence::mended,
          fmt::format(" while motor_position moves by {:.4g}: the position of the load was not "
                      "recorded; taken as absent",
                      motor));
      return drop(look, channel);
    }
    case Channel::sensor_torque:
    case Channel::output_torque:
      if (!(travel_of(r, Channel::motor_torque) > 0)) return;
      say(Consequence::mended, " while motor_torque varies: the sensor recorded nothing; taken as absent");
      return drop(look, channel);
    case Channel::motor_velocity:
    case Channel::load_velocity:
    case Channel::acceleration:
      // That of a locked output is 0.
      if (!(motor > 0) || (channel != Channel::motor_velocity && !look.declared.free_load)) return;
      say(Consequence::mended, " while motor_position moves: taken as absent");
      return drop(look, channel);
  }
}

/// A load position that was computed from the motor's shows no play, however much there is.
void look_for_copy(RecordLook& look) {
  const std::vector<double>&motor = look.record.column(Channel::motor_position),
        &load = look.record.column(Channel::load_position);
  if (motor.empty() || load.empty() || (look.declared.known && !look.declared.through_teeth)) return;
  const double travel = signal::peak_to_peak(load), ratio = signal::peak_to_peak(motor) / travel;
  if (!(travel > 0) || !std::isfinite(ratio)) return;
  double largest = 0;
  for (const double x : load) largest = std::max(largest, std::fabs(x));
  for (std::size_t i = 0; i < load.size(); ++i)
    if (!(std::fabs((motor[i] - motor[0]) / ratio - (load[i] - load[0])) <=
          kRounding * std::max(largest, travel)))
      return;
  look.say(FindingKind::dead, "load_position", look.record.time.front(), look.record.time.back(), load.size(),
           Consequence::mended,
           "load_position: is motor_position once more, sample by sample: no encoder of the load was "
           "recorded; taken as "
           "absent");
  drop(look, Channel::load_position);
}

}  // namespace

void check_dead(RecordLook& look) {
  for (const Channel channel : kChannels) {
    if (!look.record.has(channel)) continue;
    look_for_numbers(look, channel);
    const double first = look.record.column(channel).front();
    if (std::isfinite(first) && !(travel_of(look.record, channel) > 0)) say_dead(look, channel);
  }
  if (!look.declared.shares_stamps) keep_rows_with_numbers({&look.record});
  look_for_copy(look);
}

}  // namespace backlash::record
