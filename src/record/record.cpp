// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/record.h"

#include <algorithm>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/time_base.h"

namespace backlash::record {
namespace {

// In the order of the enumerators.
const std::array<std::string, kChannelCount>& channel_names() {
  static const std::array<std::string, kChannelCount> names = {
      "motor_torque",  "motor_position",     "motor_velocity", "load_position", "load_velocity",
      "sensor_torque", "reference_position", "motor_current",  "acceleration",  "output_torque"};
  return names;
}

}  // namespace

const std::array<Channel, kChannelCount> kChannels = {
    Channel::motor_torque,  Channel::motor_position, Channel::motor_velocity,     Channel::load_position,
    Channel::load_velocity, Channel::sensor_torque,  Channel::reference_position, Channel::motor_current,
    Channel::acceleration,  Channel::output_torque};

const std::array<Channel, 8> kBacklashChannels = {
    Channel::motor_torque,  Channel::sensor_torque, Channel::motor_position, Channel::motor_velocity,
    Channel::load_position, Channel::motor_current, Channel::acceleration,   Channel::output_torque};

const std::string& channel_name(Channel channel) {
  return channel_names()[static_cast<std::size_t>(channel)];
}

const char* channel_unit(Channel channel) {
  switch (channel) {
    case Channel::motor_torque:
    case Channel::sensor_torque:
    case Channel::output_torque:
      return "N m";
    case Channel::motor_position:
    case Channel::load_position:
    case Channel::reference_position:
      return "rad";
    case Channel::motor_velocity:
    case Channel::load_velocity:
      return "rad/s";
    case Channel::motor_current:
      return "A";
    case Channel::acceleration:
      break;
  }
  return "rad/s^2";
}

Channel channel_from_name(const std::string& name) {
  for (const Channel channel : kChannels) {
    if (channel_name(channel) == name) return channel;
  }
  throw InvalidParameter("channel", printable(name), "must be one of " + joined(channel_names()));
}

bool Record::can_show_backlash() const {
  return std::any_of(kBacklashChannels.begin(), kBacklashChannels.end(),
                     [this](Channel channel) { return has(channel); });
}

double Record::sampling_interval() const {
  return median_interval(time);
}

void Record::forget(std::size_t count) {
  const auto drop = [count](std::vector<double>& values) {
    values.erase(values.begin(),
                 values.begin() + static_cast<std::ptrdiff_t>(std::min(count, values.size())));
  };
  drop(time);
  for (std::vector<double>& values : columns_) drop(values);
}

std::pair<std::ptrdiff_t, std::ptrdiff_t> Record::places(double from, double to) const {
  const auto first = std::lower_bound(time.begin(), time.end(), from) - time.begin();
  const auto last = std::max(first, std::lower_bound(time.begin(), time.end(), to) - time.begin());
  for (const Channel channel : kChannels)
    if (has(channel) && column(channel).size() != time.size())
      throw BadData(name, channel_name(channel) + " has " + std::to_string(column(channel).size()) +
                              " values, time has " + std::to_string(time.size()));
  return {first, last};
}

Record Record::slice(double from, double to) const& {
  const auto [first, last] = places(from, to);
  Record part;
  part.name = name;
  part.warnings = warnings;
  part.origin = origin;
  part.repeated_stamps = repeated_stamps;
  part.first_repeated_stamp = first_repeated_stamp;
  part.unsure_time = unsure_time;
  part.whole_from = size() > 0 ? time.front() - start() : whole_from;
  part.time.assign(time.begin() + first, time.begin() + last);
  for (const Channel channel : kChannels) {
    const std::vector<double>& all = column(channel);
    if (!all.empty()) part.column(channel).assign(all.begin() + first, all.begin() + last);
  }
  return part;
}

Record Record::slice(double from, double to) && {
  const auto [first, last] = places(from, to);
  if (size() > 0) whole_from = time.front() - start();
  for (const Channel channel : kChannels)
    if (has(channel)) column(channel).resize(static_cast<std::size_t>(last));
  time.resize(static_cast<std::size_t>(last));
  forget(static_cast<std::size_t>(first));
  return std::move(*this);
}

Record samples_at(const Record& record, const std::vector<double>& times) {
  Record part;
  part.name = record.name;
  part.warnings = record.warnings;
  part.unsure_time = record.unsure_time;
  part.origin = record.origin;
  part.time = times;
  std::size_t k = 0;
  for (const double t : times) {
    while (k < record.size() && record.time[k] < t) ++k;
    if (k == record.size() || record.time[k] > t)
      throw InvalidParameter("time", t, "is of no sample of " + record.name);
    for (const Channel channel : kChannels)
      if (record.has(channel)) part.column(channel).push_back(record.column(channel)[k]);
  }
  return part;
}

}  // namespace backlash::record
