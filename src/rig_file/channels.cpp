// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/channels.h"

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/unit.h"

namespace backlash::rig_file {
namespace {

record::ChannelSource read_source(const YamlReader& yaml, record::Channel channel) {
  record::ChannelSource source;
  source.channel = channel;
  source.topic = yaml.text_or("topic", source.topic);
  source.name = yaml.text("name");
  source.field = record::usual_field(channel);
  if (yaml.has("field"))
    source.field = *record::field_from_name(yaml.choice("field", {"position", "velocity", "effort"}));
  source.scale = yaml.number_or("scale", source.scale, Range::any());
  source.offset = yaml.number_or("offset", source.offset, Range::any());
  return source;
}

record::ColumnSource read_column(const YamlReader& yaml) {
  record::ColumnSource source;
  source.column = yaml.text("column");
  source.unit = yaml.text_or("unit", "");
  if (!source.unit.empty() && record::find_unit(source.unit) == nullptr)
    yaml.fail("unit", "unknown, known are " + record::known_units());
  return source;
}

record::ColumnSource read_column(const YamlReader& yaml, record::Channel channel) {
  record::ColumnSource source = read_column(yaml);
  source.channel = channel;
  if (yaml.has("scale")) source.scale = yaml.number("scale", Range::any());
  source.offset = yaml.number_or("offset", 0, Range::any());
  return source;
}

/// A channel of messages, of a CSV, or of both.
void read_channel(const YamlReader& yaml, record::Channel channel, record::ChannelMap& map) {
  const bool column = yaml.has("column");
  if (column) map.columns.push_back(read_column(yaml, channel));
  if (column && !yaml.has("name")) return;
  for (const char* key : {"scale", "offset"})
    if (column && yaml.has(key)) yaml.fail(key, "is it that of `name` or that of `column`?");
  map.sources.push_back(read_source(yaml, channel));
}

}  // namespace

record::ChannelMap read_channels(const YamlReader& yaml, const std::string& joint, bool linear) {
  record::ChannelMap map;
  map.joint = joint;
  if (yaml.has("channels")) {
    const YamlReader channels = yaml.map("channels");
    if (const auto time = channels.optional_map(record::kTimeColumn)) map.time = read_column(*time);
    for (const record::Channel channel : record::kChannels)
      if (const auto source = channels.optional_map(record::channel_name(channel)))
        read_channel(*source, channel, map);
    map.declared = !map.sources.empty() || map.columns.empty();
  }
  if (!map.declared) map.sources = record::usual_channels(joint).sources;
  map.linear = linear;
  if (!yaml.has("channels")) return map;
  try {
    record::check(map);
  } catch (const InvalidParameter& error) {
    yaml.fail("channels", error.what());
  }
  return map;
}

}  // namespace backlash::rig_file
