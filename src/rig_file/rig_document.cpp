// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/rig_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <set>
#include <sstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::rig_file {
namespace {

constexpr std::size_t kCommentColumn = 34;  // as in the files of config/ (choice)

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

std::string with_comment(std::string line, const std::string& comment, std::size_t column = kCommentColumn) {
  if (comment.empty()) return line;
  line.resize(std::max(line.size() + 2, column), ' ');
  return line + "# " + comment;
}

/// Column of the first character that is no space; npos in an empty line.
std::size_t column_of(const std::string& line) {
  return line.find_first_not_of(' ');
}

bool says_nothing(const std::string& line) {
  const std::size_t column = column_of(line);
  return column == std::string::npos || line[column] == '#';
}

bool has_dash(const std::string& line) {
  return !says_nothing(line) && line[column_of(line)] == '-';
}

/// Puts `value` where the scalar of "key: scalar  # comment" stands; false where the line is not of that
/// form.
bool replace_scalar(std::string& line, const std::string& key, const std::string& scalar,
                    const std::string& value, const std::string& comment) {
  const std::size_t begin = column_of(line);
  if (begin == std::string::npos || line.compare(begin, key.size() + 1, key + ":") != 0) return false;
  const std::size_t at = line.find_first_not_of(' ', begin + key.size() + 1);
  if (at == std::string::npos || line.compare(at, scalar.size(), scalar) != 0) return false;
  const std::string rest = line.substr(at + scalar.size());
  if (!trimmed(rest).empty() && trimmed(rest).front() != '#') return false;
  const std::size_t column = line.find('#', at + scalar.size());
  line = line.substr(0, at) + value;
  line = comment.empty() ? line + rest
                         : with_comment(line, comment, column == std::string::npos ? kCommentColumn : column);
  return true;
}

/// The same for "key: {...}  # comment".
bool replace_map(std::string& line, const std::string& key, const std::string& value,
                 const std::string& comment) {
  const std::size_t begin = column_of(line), open = line.find('{'), close = line.find('}');
  if (begin == std::string::npos || line.compare(begin, key.size() + 1, key + ":") != 0) return false;
  if (close == std::string::npos || line.find('{', open + 1) < close) return false;
  return replace_scalar(line, key, line.substr(open, close + 1 - open), value, comment);
}

/// The same for one entry of "name: {..., key: scalar, ...}"; without `scalar` the entry is new.
bool replace_in_map(std::string& line, const std::string& key, const std::string& scalar,
                    const std::string& value) {
  const std::size_t open = line.find('{');
  if (open == std::string::npos) return false;
  if (scalar.empty()) {
    line.insert(open + 1, key + ": " + value + ", ");
    return true;
  }
  const std::string old = key + ": " + scalar;
  for (std::size_t at = line.find(old, open); at != std::string::npos; at = line.find(old, at + 1)) {
    const std::size_t end = at + old.size();
    const bool whole = end < line.size() && (line[end] == ',' || line[end] == '}' || line[end] == ' ');
    if (!whole || (line[at - 1] != ' ' && line[at - 1] != '{')) continue;
    line.replace(at, old.size(), key + ": " + value);
    return true;
  }
  return false;
}

/// The lines of entries that are indented by two, at another column.
std::vector<std::string> indented(const std::vector<std::string>& entries, std::size_t column) {
  std::vector<std::string> lines;
  for (const std::string& entry : entries)
    for (const std::string& line : split(entry, '\n'))
      lines.push_back(std::string(column, ' ') + line.substr(2));
  return lines;
}

const YamlEntry* find_terms(const YamlTree& tree) {
  const auto found = tree.root->entries.find("terms");
  return found == tree.root->entries.end() ? nullptr : &found->second;
}

}  // namespace

RigDocument::RigDocument(const std::string& text, const std::string& name)
    : name_(name), lines_(split(text, '\n')) {}

std::string RigDocument::text() const {
  std::string text;
  for (const std::string& line : lines_) text += line + '\n';
  return text;
}

RigFile RigDocument::read() const {
  return rig_file_from_text(text(), name_);
}

void RigDocument::set(const std::string& key, const std::string& value, const std::string& comment) {
  const YamlTree read = tree();
  const std::vector<std::string> path = split(key, '.');
  const YamlNode* map = read.root;
  int line = 0;  // of the key whose map this is
  const auto in_braces = [&] {
    return map != read.root && map->line == line &&
           lines_.at(std::size_t(line) - 1).find('{') != std::string::npos;
  };
  for (std::size_t depth = 0; depth < path.size(); ++depth) {
    const auto found = map->entries.find(path[depth]);
    const bool last = depth + 1 == path.size();
    if (found == map->entries.end()) {
      if (!last || map->entries.empty()) throw BadData(name_, key + ": its map is missing");
      if (in_braces() && replace_in_map(lines_.at(std::size_t(line) - 1), path[depth], "", value)) return;
      const auto before = std::ptrdiff_t(map->line) - 1;  // of the first key in the map
      const std::string indent(column_of(lines_.at(before)), ' ');
      lines_.insert(lines_.begin() + before, with_comment(indent + path[depth] + ": " + value, comment));
      return;
    }
    const YamlEntry& entry = found->second;
    if (!last) {
      if (entry.value->kind != YamlNode::Kind::map)
        throw BadData(name_, key + ": " + path[depth] + " is no map");
      map = entry.value;
      line = entry.line;
    } else if (in_braces()) {
      if (entry.value->kind != YamlNode::Kind::plain ||
          !replace_in_map(lines_.at(std::size_t(line) - 1), path[depth], entry.value->scalar, value))
        throw BadData(fmt::format("{}:{}", name_, entry.line),
                      key + ": is no plain value of a map on a line");
    } else if (entry.value->kind == YamlNode::Kind::map) {
      if (!replace_map(lines_.at(entry.line - 1), path[depth], value, comment))
        throw BadData(fmt::format("{}:{}", name_, entry.line), key + ": is no map on a line of its own");
    } else if (!replace_scalar(lines_.at(entry.line - 1), path[depth], entry.value->scalar, value, comment)) {
      throw BadData(fmt::format("{}:{}", name_, entry.line),
                    key + ": is no plain value on a line of its own");
    }
  }
}

void RigDocument::set(const std::string& key, double value, const std::string& comment) {
  set(key, fmt::format("{:.6g}", value), comment);
}

void RigDocument::set_section(const std::string& key, const std::string& entries,
                              const std::string& comment) {
  const YamlTree read = tree();
  const auto old = read.root->entries.find(key);
  if (old != read.root->entries.end()) {
    const auto begin = std::size_t(old->second.line) - 1;
    std::size_t end = begin + 1;
    while (end < lines_.size() && (lines_[end].empty() || lines_[end][0] == ' ')) ++end;
    lines_.erase(lines_.begin() + std::ptrdiff_t(begin), lines_.begin() + std::ptrdiff_t(end));
  }
  lines_.insert(lines_.end(), {"", with_comment(key + ":", comment)});
  for (const std::string& line : split(entries, '\n')) lines_.push_back(line);
}

void RigDocument::set_contact_law(const model::ContactSpec& contact) {
  const YamlTree read = tree();
  const YamlNode& declared =
      *read.root->entries.at("gear_train").value->entries.at("mesh").value->entries.at("contact").value;
  std::set<int, std::greater<>> dropped;  // lines, the last one first
  for (const auto& [key, entry] : declared.entries)
    if (key != "law" && !contact.values.has(key)) dropped.insert(entry.line);
  for (const int line : dropped) lines_.erase(lines_.begin() + line - 1);
  set("gear_train.mesh.contact.law", contact.law);
  for (const model::ContactLawType& type : model::contact_laws()) {
    if (type.name != contact.law) continue;
    for (const ParameterSpec& spec : type.parameters)
      set("gear_train.mesh.contact." + spec.name, contact.values.at(spec.name), spec.unit);
  }
}

void RigDocument::set_whole_path_of_test_runs() {
  const YamlReader yaml = YamlReader::from_text(text(), name_);
  if (!yaml.has("test_runs") || !yaml.is_text("test_runs")) return;
  const std::filesystem::path beside = std::filesystem::absolute(name_).parent_path();
  std::ostringstream quoted;
  quoted << std::quoted((beside / yaml.text("test_runs")).lexically_normal().string());
  set("test_runs", quoted.str());
}

RigDocument::Item RigDocument::item(const YamlEntry& list, const YamlNode& node) const {
  const auto key = std::size_t(list.line) - 1;
  std::size_t begin = std::size_t(node.line) - 1;
  while (begin > key && !has_dash(lines_[begin])) --begin;
  if (begin == key)
    throw BadData(fmt::format("{}:{}", name_, list.line),
                  "terms: must have a line for each value (block style) to be changed");
  Item item{begin, begin + 1, column_of(lines_[begin])};
  for (std::size_t k = item.end; k < lines_.size(); ++k) {
    if (says_nothing(lines_[k])) continue;
    if (column_of(lines_[k]) <= item.column) break;
    item.end = k + 1;
  }
  return item;
}

void RigDocument::append_terms(const std::vector<std::string>& entries, const std::string& comment) {
  if (entries.empty()) return;
  const YamlTree read = tree();
  const YamlEntry* terms = find_terms(read);
  if (terms != nullptr && !terms->value->items.empty()) {
    const Item last = item(*terms, *terms->value->items.back());
    const Lines lines = indented(entries, last.column);
    lines_.insert(lines_.begin() + std::ptrdiff_t(last.end), lines.begin(), lines.end());
    return;
  }
  if (terms != nullptr) lines_.erase(lines_.begin() + terms->line - 1);  // terms: []
  const Lines lines = indented(entries, 2);
  lines_.insert(lines_.end(), {"", with_comment("terms:", comment)});
  lines_.insert(lines_.end(), lines.begin(), lines.end());
}

void RigDocument::check_terms() const {
  const YamlTree read = tree();
  const YamlEntry* terms = find_terms(read);
  if (terms != nullptr && !terms->value->items.empty()) item(*terms, *terms->value->items.back());
}

void RigDocument::replace_terms(const std::function<bool(const std::string&)>& is_old,
                                const std::vector<std::string>& entries) {
  const YamlTree read = tree();
  std::vector<Item> old;
  if (const YamlEntry* terms = find_terms(read))
    for (const YamlNode* node : terms->value->items)
      if (const auto id = node->entries.find("id");
          id != node->entries.end() && is_old(id->second.value->scalar))
        old.push_back(item(*terms, *node));
  if (old.empty()) throw BadData(name_, "terms: has no entry to be replaced");
  for (std::size_t i = old.size(); i-- > 0;) {
    const auto begin = lines_.begin() + std::ptrdiff_t(old[i].begin);
    const auto at = lines_.erase(begin, begin + std::ptrdiff_t(old[i].end - old[i].begin));
    if (i > 0) continue;
    const Lines lines = indented(entries, old[i].column);
    lines_.insert(at, lines.begin(), lines.end());
  }
}

void RigDocument::drop_head() {
  const auto is_head = [](const std::string& line) { return line.empty() || line.front() == '#'; };
  lines_.erase(lines_.begin(), std::find_if_not(lines_.begin(), lines_.end(), is_head));
}

}  // namespace backlash::rig_file
