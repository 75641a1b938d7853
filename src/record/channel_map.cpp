// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/channel_map.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::record {

const char* field_name(Field field) {
  static const char* const kNames[] = {"position", "velocity", "effort"};
  return kNames[static_cast<int>(field)];
}

std::optional<Field> field_from_name(const std::string& name) {
  for (const Field field : {Field::position, Field::velocity, Field::effort})
    if (name == field_name(field)) return field;
  return std::nullopt;
}

Field usual_field(Channel channel) {
  switch (channel) {
    case Channel::motor_position:
    case Channel::load_position:
    case Channel::reference_position:
      return Field::position;
    case Channel::motor_velocity:
    case Channel::load_velocity:
      return Field::velocity;
    default:
      return Field::effort;
  }
}

std::vector<std::string> ChannelMap::topics() const {
  std::vector<std::string> all;
  for (const ChannelSource& s : sources)
    if (std::find(all.begin(), all.end(), s.topic) == all.end()) all.push_back(s.topic);
  const auto motor = std::find_if(sources.begin(), sources.end(), [](const ChannelSource& s) {
    return s.channel == Channel::motor_position;
  });
  if (motor != sources.end()) {
    const auto place = std::find(all.begin(), all.end(), motor->topic);
    std::rotate(all.begin(), place, place + 1);
  }
  return all;
}

ChannelMap ChannelMap::on(const std::string& topic) const {
  ChannelMap part{joint, {}, declared};
  for (const ChannelSource& s : sources)
    if (s.topic == topic) part.sources.push_back(s);
  return part;
}

ChannelMap usual_channels(const std::string& joint) {
  static const std::pair<Channel, const char*> kNames[] = {
      {Channel::motor_position, "_motor"},  {Channel::motor_velocity, "_motor"},
      {Channel::motor_torque, "_motor"},    {Channel::sensor_torque, "_sensor"},
      {Channel::load_position, "_load"},    {Channel::load_velocity, "_load"},
      {Channel::output_torque, "_load"},    {Channel::reference_position, "_reference"},
      {Channel::motor_current, "_current"}, {Channel::acceleration, "_accelerometer"}};
  ChannelMap map;
  map.joint = joint;
  for (const auto& [channel, suffix] : kNames) {
    ChannelSource source;
    source.channel = channel;
    source.name = joint + suffix;
    source.field = usual_field(channel);
    map.sources.push_back(source);
  }
  return map;
}

void check(const ChannelMap& map) {
  const auto require = [](bool valid, const ChannelSource& s, const char* key, const std::string& value,
                          const char* limit) {
    if (!valid) throw InvalidParameter("channels." + channel_name(s.channel) + "." + key, value, limit);
  };
  bool shows = false;
  for (std::size_t i = 0; i < map.sources.size(); ++i) {
    const ChannelSource& s = map.sources[i];
    require(!s.name.empty(), s, "name", "''", "must not be empty");
    require(!s.topic.empty(), s, "topic", "''", "must not be empty");
    require(std::isfinite(s.scale) && s.scale != 0, s, "scale", std::to_string(s.scale),
            "must be finite and not 0");
    require(std::isfinite(s.offset), s, "offset", std::to_string(s.offset), "must be finite");
    for (std::size_t k = 0; k < i; ++k)
      require(map.sources[k].channel != s.channel, s, "name", s.name,
              "must be the only source of the channel");
    shows = shows || std::count(kBacklashChannels.begin(), kBacklashChannels.end(), s.channel) > 0;
  }
  if (!shows)
    throw InvalidParameter(
        "channels", map.joint,
        "must have a torque, a position, the speed of the motor, a current or an acceleration");
}

}  // namespace backlash::record
