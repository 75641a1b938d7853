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
#include "backlash_diagnosis/rig_file/rig_parameters.h"

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

/// The lines of entries that are indented by two, moved to another column.
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

RigDocument::Place RigDocument::begin_of(const YamlNode& node) const {
  return {std::size_t(node.line) - 1, std::size_t(node.column)};
}

/// Behind the last character of a scalar, or of a list or map in brackets.
RigDocument::Place RigDocument::end_of(const YamlNode& node, const std::string& key) const {
  Place at = begin_of(node);
  const auto refuse = [&](const std::string& reason) {
    throw BadData(fmt::format("{}:{}", name_, node.line), key + ": " + reason);
  };
  const bool brackets = node.flow;
  if (node.kind == YamlNode::Kind::plain) {
    if (lines_.at(at.line).compare(at.column, node.scalar.size(), node.scalar) != 0)
      refuse("is no plain value on one line");
    return {at.line, at.column + node.scalar.size()};
  }
  if (node.kind == YamlNode::Kind::null || (!brackets && node.kind != YamlNode::Kind::quoted))
    refuse("is neither a value nor in brackets");
  int depth = 0;
  char quote = 0;
  for (; at.line < lines_.size(); ++at.line, at.column = 0) {
    const std::string& line = lines_[at.line];
    for (; at.column < line.size(); ++at.column) {
      const char c = line[at.column];
      if (quote == '"' && c == '\\')
        ++at.column;
      else if (quote != 0 && c == quote)
        quote = 0;  // a doubled one opens again
      else if (quote == 0 && (c == '"' || c == '\''))
        quote = c;
      else if (quote == 0 && c == '#' && (at.column == 0 || line[at.column - 1] == ' '))
        break;
      else if (quote == 0)
        depth += (c == '[' || c == '{') - (c == ']' || c == '}');
      if (quote == 0 && depth == 0) return {at.line, at.column + 1};
    }
  }
  refuse("does not end");
  return at;
}

/// In its place. A comment stands behind the only value of a line.
void RigDocument::replace(const YamlNode& node, const std::string& key, const std::string& value,
                          const std::string& comment) {
  const Place begin = begin_of(node), end = end_of(node, key);
  const std::string rest = lines_[end.line].substr(end.column);
  const std::size_t note = rest.find('#');
  std::string line = lines_[begin.line].substr(0, begin.column) + value;
  if (comment.empty() || trimmed(rest.substr(0, note)).size() > 0)
    line += rest;
  else
    line = with_comment(line, comment, note == std::string::npos ? kCommentColumn : end.column + note);
  lines_[begin.line] = line;
  lines_.erase(lines_.begin() + std::ptrdiff_t(begin.line) + 1,
               lines_.begin() + std::ptrdiff_t(end.line) + 1);
}

/// As the first of its map.
void RigDocument::insert(const YamlNode& map, const std::string& key, const std::string& value,
                         const std::string& comment) {
  const Place begin = begin_of(map);
  std::string& line = lines_.at(begin.line);
  if (map.flow) {
    line.insert(begin.column + 1, key + ": " + value + (map.entries.empty() ? "" : ", "));
    return;
  }
  const std::string indent(begin.column, ' ');
  lines_.insert(lines_.begin() + std::ptrdiff_t(begin.line),
                with_comment(indent + key + ": " + value, comment));
}

void RigDocument::set(const std::string& key, const std::string& value, const std::string& comment) {
  const YamlTree read = tree();
  const std::vector<std::string> path = split(key, '.');
  const YamlNode* map = read.root;
  for (std::size_t depth = 0; depth < path.size(); ++depth) {
    const auto found = map->entries.find(path[depth]);
    const bool last = depth + 1 == path.size();
    if (found == map->entries.end()) {
      if (!last || (map->entries.empty() && !map->flow)) throw BadData(name_, key + ": its map is missing");
      return insert(*map, path[depth], value, comment);
    }
    const YamlNode& node = *found->second.value;
    if (last) return replace(node, key, value, map->flow ? "" : comment);
    if (node.kind != YamlNode::Kind::map) throw BadData(name_, key + ": " + path[depth] + " is no map");
    map = &node;
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
  const auto type = std::find_if(model::contact_laws().begin(), model::contact_laws().end(),
                                 [&](const model::ContactLawType& each) { return each.name == contact.law; });
  const std::string key = "gear_train.mesh.contact";
  if (declared.flow) {
    std::string values = "{law: " + contact.law;
    for (const ParameterSpec& spec : type->parameters)
      values += fmt::format(", {}: {:.6g}", spec.name, contact.values.at(spec.name));
    return replace(declared, key, values + "}", "");
  }
  std::set<int, std::greater<>> dropped;  // lines, the last one first
  for (const auto& [name, entry] : declared.entries)
    if (name != "law" && !contact.values.has(name)) dropped.insert(entry.line);
  for (const int line : dropped) lines_.erase(lines_.begin() + line - 1);
  set(key + ".law", contact.law);
  for (const ParameterSpec& spec : type->parameters)
    set(key + "." + spec.name, contact.values.at(spec.name), spec.unit);
}

void RigDocument::set_whole_path_of_test_runs() {
  const YamlReader yaml = YamlReader::from_text(text(), name_);
  if (!yaml.has("test_runs") || !yaml.is_text("test_runs")) return;
  const std::filesystem::path beside = std::filesystem::absolute(name_).parent_path();
  std::ostringstream quoted;
  quoted << std::quoted((beside / yaml.text("test_runs")).lexically_normal().string());
  set("test_runs", quoted.str());
}

/// A list in brackets gets a line for each item; what stands in them stays as it is.
void RigDocument::list_by_lines(const std::string& key) {
  const YamlTree read = tree();
  const auto found = read.root->entries.find(key);
  if (found == read.root->entries.end() || !found->second.value->flow) return;
  const YamlNode& list = *found->second.value;
  Lines items;
  for (const YamlNode* node : list.items) {
    const Place begin = begin_of(*node), end = end_of(*node, key);
    std::string text;
    for (std::size_t k = begin.line; k <= end.line; ++k) {
      const std::size_t from = k == begin.line ? begin.column : 0;
      text +=
          (k == begin.line ? "" : "\n    ") +
          std::string(trimmed(lines_[k].substr(from, k == end.line ? end.column - from : std::string::npos)));
    }
    for (const std::string& line : split("  - " + text, '\n')) items.push_back(line);
  }
  if (items.empty()) return;
  const Place end = end_of(list, key);
  const std::size_t behind = end.line + 1;
  const std::string rest = std::string(trimmed(lines_[end.line].substr(end.column)));
  std::string& head = lines_[begin_of(list).line];
  head = std::string(trimmed(head.substr(0, begin_of(list).column))) + (rest.empty() ? "" : "  " + rest);
  const auto first = lines_.erase(lines_.begin() + std::ptrdiff_t(begin_of(list).line) + 1,
                                  lines_.begin() + std::ptrdiff_t(behind));
  lines_.insert(first, items.begin(), items.end());
}

RigDocument::Item RigDocument::item(const YamlEntry& list, const YamlNode& node) const {
  const auto key = std::size_t(list.line) - 1;
  std::size_t begin = std::size_t(node.line) - 1;
  while (begin > key && !has_dash(lines_[begin])) --begin;
  if (begin == key)
    throw BadData(fmt::format("{}:{}", name_, list.line), "terms: an item has no line of its own");
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
  list_by_lines("terms");
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

void RigDocument::check_changes(const model::Rig& declared) const {
  RigDocument copy = *this;
  if (!declared.mesh.rigid) copy.set_contact_law(declared.mesh.contact_spec());
  const model::Rig rig = model::load_side(declared);
  std::map<std::string, signal::Measured> parameters;
  std::map<std::string, std::string> units;
  for (const RigParameter& p : servo_parameters()) {
    const bool skew = p.kind == ParameterKind::encoder_skew;
    if (!p.known_to(declared) || (p.get(declared) == 0 && !skew)) continue;
    parameters[p.name] = {p.get(rig) + (skew ? 1 : 0), 0};  // one that is found makes a new line
    units[p.name] = p.unit;
  }
  copy.set_fitted({rig, declared.motor_axis_ratio(), parameters, units});
  copy.append_terms({"  - id: gravity\n"}, "");
}

void RigDocument::replace_terms(const std::function<bool(const std::string&)>& is_old,
                                const std::vector<std::string>& entries) {
  list_by_lines("terms");
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
