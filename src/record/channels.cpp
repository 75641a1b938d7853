// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/channels.h"

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/unit.h"

namespace backlash::record {
namespace {

ChannelSource read_source(const YamlReader& yaml, Channel channel) {
  ChannelSource source;
  source.channel = channel;
  source.topic = yaml.text_or("topic", source.topic);
  source.name = yaml.text("name");
  source.field = usual_field(channel);
  if (yaml.has("field"))
    source.field = *field_from_name(yaml.choice("field", {"position", "velocity", "effort"}));
  source.scale = yaml.number_or("scale", source.scale, Range::any());
  source.offset = yaml.number_or("offset", source.offset, Range::any());
  return source;
}

constexpr int kMostBits = 32;
constexpr long kMostElements = 1'000'000;

void read_unit(const YamlReader& yaml, ColumnSource& source) {
  source.unit = yaml.text_or("unit", "");
  if (!source.unit.empty() && find_unit(source.unit) == nullptr)
    yaml.fail("unit", "unknown, known are " + known_units());
}

void read_place(const YamlReader& yaml, ColumnSource& source) {
  source.column = yaml.text("column");
  source.element = static_cast<std::size_t>(yaml.integer_or("element", 0, 1, kMostElements));
}

/// Of a column, or of a sum or product of them.
ColumnSource read_column(const YamlReader& yaml) {
  ColumnSource source;
  int ways = 0;
  for (const char* key : {"column", "sum", "product"}) ways += yaml.has(key) ? 1 : 0;
  if (ways != 1) yaml.fail("column", "must be there, or a sum or a product of columns, one of the three");
  if (yaml.has("column")) {
    read_place(yaml, source);
    source.bits = static_cast<int>(yaml.integer_or("bits", 0, 2, kMostBits));
  }
  if (yaml.has("sum"))
    for (const YamlReader& part : yaml.maps("sum")) source.sum.push_back(read_column(part));
  if (yaml.has("product"))
    for (const YamlReader& part : yaml.maps("product")) source.product.push_back(read_column(part));
  read_unit(yaml, source);
  if (yaml.has("scale")) source.scale = yaml.number("scale", Range::any());
  source.offset = yaml.number_or("offset", 0, Range::any());
  return source;
}

ColumnSource read_column(const YamlReader& yaml, Channel channel) {
  ColumnSource source = read_column(yaml);
  source.channel = channel;
  return source;
}

/// A channel of messages, of a CSV, or of both.
void read_channel(const YamlReader& yaml, Channel channel, ChannelMap& map) {
  const bool column = yaml.has("column") || yaml.has("sum") || yaml.has("product");
  if (column) map.columns.push_back(read_column(yaml, channel));
  if (column && !yaml.has("name")) return;
  for (const char* key : {"scale", "offset"})
    if (column && yaml.has(key)) yaml.fail(key, "is it that of `name` or that of `column`?");
  map.sources.push_back(read_source(yaml, channel));
}

}  // namespace

void read_time(const YamlReader& channels, ChannelMap& map) {
  const auto time = channels.optional_map(kTimeColumn);
  if (!time) return;
  map.time = {};
  map.rate = 0;
  if (time->has("rate")) {
    map.rate = time->number("rate", Range::positive());
    return;
  }
  read_place(*time, map.time);
  read_unit(*time, map.time);
}

ChannelMap read_channels(const YamlReader& yaml, const std::string& joint, bool linear,
                         const ChannelMap& time) {
  ChannelMap map;
  map.joint = joint;
  map.time = time.time;
  map.rate = time.rate;
  if (yaml.has("channels")) {
    const YamlReader channels = yaml.map("channels");
    read_time(channels, map);
    for (const Channel channel : kChannels)
      if (const auto source = channels.optional_map(channel_name(channel)))
        read_channel(*source, channel, map);
    map.declared = !map.sources.empty() || map.columns.empty();
  }
  if (!map.declared) map.sources = usual_channels(joint).sources;
  map.linear = linear;
  if (!yaml.has("channels")) return map;
  try {
    check(map);
  } catch (const InvalidParameter& error) {
    yaml.fail("channels", error.what());
  }
  return map;
}

namespace {

/// For a text of YAML in double quotes.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string column_text(const ColumnSource& source) {
  const auto parts = [](const std::vector<ColumnSource>& all) {
    std::vector<std::string> texts;
    for (const ColumnSource& part : all) texts.push_back(column_text(part));
    return "[" + joined(texts) + "]";
  };
  std::string text = !source.sum.empty()       ? "sum: " + parts(source.sum)
                     : !source.product.empty() ? "product: " + parts(source.product)
                                               : "column: \"" + escaped(source.column) + "\"";
  if (source.element > 0) text += ", element: " + std::to_string(source.element);
  if (source.bits > 0) text += ", bits: " + std::to_string(source.bits);
  if (!source.unit.empty()) text += ", unit: \"" + source.unit + "\"";
  if (source.scale) text += ", scale: " + to_text(*source.scale);
  if (source.offset != 0) text += ", offset: " + to_text(source.offset);
  return "{" + text + "}";
}

}  // namespace

std::string time_column_text(const ChannelMap& map) {
  return kTimeColumn + ": " + (map.rate != 0 ? "{rate: " + to_text(map.rate) + "}" : column_text(map.time));
}

std::string columns_text(const ChannelMap& map, const std::string& indent) {
  std::string text;
  for (const ColumnSource& source : map.columns)
    text += indent + channel_name(source.channel) + ": " + column_text(source) + "\n";
  return text;
}

}  // namespace backlash::record
