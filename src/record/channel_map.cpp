// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/channel_map.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/unit.h"

namespace backlash::record {
namespace {

constexpr int kMostBits =
    32;  // theory: whole numbers that a double holds; counters and drives have 8, 16 or 32

}  // namespace

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
  ChannelMap part;
  part.joint = joint;
  part.declared = declared;
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

namespace {

void require(bool valid, const std::string& source, const char* key, const std::string& value,
             const std::string& limit) {
  if (!valid) throw InvalidParameter("channels." + source + "." + key, value, limit);
}

void check_conversion(const std::string& source, double scale, double offset) {
  require(std::isfinite(scale) && scale != 0, source, "scale", std::to_string(scale),
          "must be finite and not 0");
  require(std::isfinite(offset), source, "offset", std::to_string(offset), "must be finite");
}

template <typename Sources>
void check_channels(const Sources& sources, const std::string& joint) {
  bool shows = false;
  for (auto s = sources.begin(); s != sources.end(); ++s) {
    for (auto other = sources.begin(); other != s; ++other)
      require(other->channel != s->channel, channel_name(s->channel), "name", joint,
              "must be the only source of the channel");
    shows = shows || std::count(kBacklashChannels.begin(), kBacklashChannels.end(), s->channel) > 0;
  }
  if (!shows)
    throw InvalidParameter(
        "channels", joint,
        "must have a torque, a position, the speed of the motor, a current or an acceleration");
}

/// A channel keeps the meaning that its name has in the package's own format.
void check_own_name(const ColumnSource& s, const std::string& source, const std::string& own,
                    const Unit* unit) {
  const std::string name = s.column.substr(s.column.rfind('/') + 1);
  if (!is_own_column(s.column)) return;
  const bool same =
      name == own && (unit == nullptr || unit->si(1) == 1) && s.scale.value_or(1) == 1 && s.offset == 0;
  require(same, source, "column", s.column,
          "is a name of the package's own format, where it is " + name +
              " in SI units: rename it in the header, or give it its unit there (" + name + " [...])");
}

void check_computed(const ColumnSource& s, const std::string& source);

void check_column(const ColumnSource& s, const std::string& source, const std::string& own) {
  check_conversion(source, s.scale.value_or(1), s.offset);
  const Unit* const unit = s.unit.empty() ? nullptr : find_unit(s.unit);
  require(s.unit.empty() || unit != nullptr, source, "unit", s.unit, "unknown, known are " + known_units());
  if (s.is_computed()) return check_computed(s, source);
  require(!s.column.empty(), source, "column", "''", "must not be empty");
  require(s.bits == 0 || (s.bits > 1 && s.bits <= kMostBits), source, "bits", std::to_string(s.bits),
          "must be 2 to " + std::to_string(kMostBits));
  check_own_name(s, source, own, unit);
}

void check_computed(const ColumnSource& s, const std::string& source) {
  require(s.column.empty() && (s.sum.empty() || s.product.empty()), source, "column", s.column,
          "must be the only one of column, sum and product");
  require(!s.unit.empty(), source, "unit", "''", "must be said of a sum or product");
  for (const std::vector<ColumnSource>* parts : {&s.sum, &s.product})
    for (const ColumnSource& part : *parts) {
      require(!is_own_column(part.column), source, "column", part.column,
              "is a name of the package's own format, of which nothing is computed");
      check_column(part, source, "");
    }
}

void check_time(const ChannelMap& map) {
  if (map.rate != 0) {
    require(std::isfinite(map.rate) && map.rate > 0, kTimeColumn, "rate", std::to_string(map.rate),
            "must be > 0");
    require(map.time.column.empty(), kTimeColumn, "column", map.time.column, "is said beside a rate");
    return;
  }
  require(!map.time.column.empty(), kTimeColumn, "column", "''",
          "must name the column with the time; where there is none say its rate (Hz)");
  check_column(map.time, kTimeColumn, kTimeColumn);
  if (const Unit* const unit = find_unit(map.time.unit))
    require(unit->quantity == Quantity::time, kTimeColumn, "unit", map.time.unit, "is no time");
}

void check_columns(const ChannelMap& map) {
  check_time(map);
  for (const ColumnSource& s : map.columns) {
    const std::string& name = channel_name(s.channel);
    check_column(s, name, name);
    require(s.is_computed() || s.column != map.time.column || s.element != map.time.element, name, "column",
            s.column, "is the column with the time");
    if (const Unit* const unit = find_unit(s.unit)) {
      const std::string reason = misfit(*unit, s.channel, map.linear, s.scale.has_value());
      require(reason.empty(), name, "unit", s.unit, reason);
    }
  }
  check_channels(map.columns, map.joint);
}

}  // namespace

const std::string kTimeColumn = "time";

bool is_own_column(std::string_view name) {
  const std::string_view channel = name.substr(name.rfind('/') + 1);
  return name == kTimeColumn || std::any_of(kChannels.begin(), kChannels.end(),
                                            [&](Channel c) { return channel == channel_name(c); });
}

void check(const ChannelMap& map) {
  for (const ChannelSource& s : map.sources) {
    const std::string& name = channel_name(s.channel);
    require(!s.name.empty(), name, "name", "''", "must not be empty");
    require(!s.topic.empty(), name, "topic", "''", "must not be empty");
    check_conversion(name, s.scale, s.offset);
  }
  if (!map.columns.empty() || !map.time.column.empty()) check_columns(map);
  if (map.declared || map.columns.empty()) check_channels(map.sources, map.joint);
}

}  // namespace backlash::record
