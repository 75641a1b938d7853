// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/table_file.h"
#include "mapped_rows.h"

namespace backlash::record {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has no word for what is no number; Python writes it all the same.
std::string without_words(const std::string& text) {
  std::string out;
  out.reserve(text.size());
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escape = quoted && text[i] == '\\' && i + 1 < text.size();
    if (escape) out += text[i++];
    if (text[i] == '"' && !escape) quoted = !quoted;
    std::size_t word = 0;
    for (const std::string_view name : {"NaN", "Infinity", "-Infinity"})
      if (!quoted && text.compare(i, name.size(), name) == 0) word = name.size();
    out += word > 0 ? "null" : std::string(1, text[i]);
    if (word > 0) i += word - 1;
  }
  return out;
}

bool is_entries(const Json& json) {
  return json.is_array() && !json.empty() && json.front().is_object();
}

bool is_column(const Json& json) {
  return json.is_array() && !json.empty() && (json.front().is_number() || json.front().is_array());
}

/// The table in a file, as rows that are objects or as columns that are lists.
class JsonTable {
 public:
  JsonTable(const std::string& text, const std::string& name) : name_(name) {
    try {
      json_ = Json::parse(without_words(text));
    } catch (const Json::exception& error) {
      throw BadData(name, std::string("is no JSON: ") + printable(error.what(), 200));
    }
    find_entries();
    if (entries_ == nullptr) find_columns();
  }

  const std::vector<std::string>& names() const { return names_; }
  std::size_t size() const { return size_; }

  std::string text(std::size_t row, const MappedColumn& column, const Place& place) const {
    const std::string& key = names_[column.place];
    const Json* value = nullptr;
    if (entries_ == nullptr) {
      value = &json_[key][row];
    } else {
      const Json& entry = (*entries_)[row];
      if (!entry.is_object()) place.fail("is no object");
      const auto found = entry.find(key);
      if (found == entry.end()) return "null";
      value = &*found;
    }
    const std::size_t element = column.source->element;
    if (element > (value->is_array() ? value->size() : 1) && !value->is_null())
      place.fail(printable(key) + " = " + in_quotes(value->dump()) + ": has no element " +
                 std::to_string(element));
    if (element > 0 && value->is_array()) value = &(*value)[element - 1];
    if (value->is_boolean()) return value->get<bool>() ? "1" : "0";
    return value->is_string() ? value->get<std::string>() : value->dump();
  }

 private:
  void find_entries() {
    std::vector<std::string> lists;
    if (is_entries(json_)) entries_ = &json_;
    if (json_.is_object())
      for (const auto& [key, value] : json_.items())
        if (is_entries(value)) lists.push_back(key), entries_ = &value;
    if (lists.size() > 1)
      throw BadData(name_,
                    "has several lists of entries: " + joined(lists) + "; leave one of them in the file");
    if (entries_ == nullptr) return;
    size_ = entries_->size();
    for (const auto& [key, value] : entries_->front().items()) names_.push_back(key);
  }

  void find_columns() {
    if (json_.is_object())
      for (const auto& [key, value] : json_.items()) {
        if (!is_column(value)) continue;
        if (!names_.empty() && value.size() != size_)
          throw BadData(name_, printable(key) + " has " + std::to_string(value.size()) + " values, " +
                                   printable(names_.front()) + " has " + std::to_string(size_));
        size_ = value.size();
        names_.push_back(key);
      }
    if (names_.empty())
      throw BadData(name_,
                    "holds no table: expected a list of entries {name: number, ...}, or an object of "
                    "lists of numbers");
  }

  const std::string name_;
  Json json_;
  const Json* entries_ = nullptr;
  std::vector<std::string> names_;
  std::size_t size_ = 0;
};

}  // namespace

Record read_json(const std::string& text, const std::string& name, const ChannelMap& map) {
  const JsonTable table(text, name);
  MappedRows rows(name, map);
  if (const MappedRows::Match match = rows.find(table.names()); !match.refusal.empty())
    throw BadData(name, match.refusal);
  Place place(name, ", entry ");
  rows.resolve_units({}, place, 1, 1);
  std::vector<std::string> texts(rows.columns().size());
  for (std::size_t row = 0; row < table.size(); ++row) {
    place.go_to(row + 1);
    for (std::size_t i = 0; i < texts.size(); ++i) texts[i] = table.text(row, rows.columns()[i], place);
    rows.add(texts, place);
  }
  return rows.finish();
}

}  // namespace backlash::record
