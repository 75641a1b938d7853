// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/channels.h"

#include "backlash_diagnosis/base/error.h"

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

}  // namespace

record::ChannelMap read_channels(const YamlReader& yaml, const std::string& joint) {
  if (!yaml.has("channels")) return record::usual_channels(joint);
  const YamlReader channels = yaml.map("channels");
  record::ChannelMap map;
  map.joint = joint;
  map.declared = true;
  for (const record::Channel channel : record::kChannels)
    if (const auto source = channels.optional_map(record::channel_name(channel)))
      map.sources.push_back(read_source(*source, channel));
  try {
    record::check(map);
  } catch (const InvalidParameter& error) {
    yaml.fail("channels", error.what());
  }
  return map;
}

}  // namespace backlash::rig_file
