// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/yaml_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/yaml_problems.h"
#include "backlash_diagnosis/base/yaml_tree.h"

namespace backlash {
namespace {

using Kind = YamlNode::Kind;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string shown(const YamlNode& node) {
  switch (node.kind) {
    case Kind::null:
      return "null";
    case Kind::plain:
      return printable(node.scalar);
    case Kind::quoted:
      return "'" + printable(node.scalar) + "'";
    case Kind::list:
      return "[...]";
    case Kind::map:
      return "{...}";
  }
  return "";
}

// Why the node is not the plain scalar that `expected` needs; empty where it is one.
std::string scalar_problem(const YamlNode& node, const std::string& expected) {
  switch (node.kind) {
    case Kind::null:
      return "has no value, expected " + expected;
    case Kind::plain:
      return "";
    case Kind::quoted:
      return "is text in quotes, expected " + expected;
    case Kind::list:
      return "is a list, expected " + expected;
    case Kind::map:
      return "is a map, expected " + expected;
  }
  return "";
}

std::string number_problem(const YamlNode& node, const Range& range, double& value) {
  std::string problem = scalar_problem(node, "a number");
  if (!problem.empty()) return problem;
  const ParsedNumber number = parse_number(node.scalar);
  if (number && range.contains(number.value)) {
    value = number.value;
    return "";
  }
  const bool bounded = range.lower > -kInfinity || range.upper < kInfinity;
  if (number) return range.text();
  return number.problem + (bounded ? ", " + range.text() : std::string());
}

std::string text_problem(const YamlNode& node) {
  return node.kind == Kind::quoted ? "" : scalar_problem(node, "text");
}

}  // namespace

Range Range::any() {
  return {-kInfinity, kInfinity};
}
Range Range::positive() {
  return {0, kInfinity, true};
}
Range Range::not_negative() {
  return {0, kInfinity};
}
Range Range::between(double lower, double upper) {
  return {lower, upper};
}

bool Range::contains(double value) const {
  return std::isfinite(value) && (open_lower ? value > lower : value >= lower) && value <= upper;
}

std::string Range::text() const {
  const std::string from = (open_lower ? "> " : ">= ") + to_text(lower), to = "<= " + to_text(upper);
  if (lower == -kInfinity && upper == kInfinity) return "must be finite";
  if (lower == -kInfinity) return "must be " + to;
  if (upper == kInfinity) return "must be " + from;
  return "must be " + from + " and " + to;
}

/// What is handed out where a number is missing or wrong, and all mistakes are collected.
double some_number(const Range& range) {
  const double from = range.lower > -kInfinity ? range.lower : std::min(0.0, range.upper);
  return range.upper < kInfinity ? (from + range.upper) / 2 : from + 1;
}

/// "30 %" or a number in the unit of the value.
std::string uncertainty_problem(const YamlNode& node, Uncertainty& u) {
  const char* const kExpected = "a number > 0, or one with % behind it";
  std::string problem = scalar_problem(node, kExpected);
  if (!problem.empty()) return problem;
  std::string text = node.scalar;
  u.relative = !text.empty() && text.back() == '%';
  if (u.relative) text = std::string(trimmed(text.substr(0, text.size() - 1)));
  const ParsedNumber number = parse_number(text);
  if (!number || !(number.value > 0)) return std::string("must be ") + kExpected;
  u.size = u.relative ? number.value / 100 : number.value;
  return "";
}

// A map of the document with what was asked of it. A map that an alias shows in two places has two of these.
struct YamlReader::Impl {
  std::shared_ptr<const YamlTree> tree;
  const YamlNode* node = nullptr;
  std::string path;  // "gear_train.motor", empty at the top
  int line = 0;
  std::set<std::string> asked;
  bool absent = false;  // it stands for one that is missing or no map: nobody complains of what it lacks
  bool unused_uncertainty = false;  // it is a number with one that nobody asked for
  std::map<std::pair<std::string, std::size_t>, std::shared_ptr<Impl>>
      children;  // by key and index in a list

  [[noreturn]] void fail_at(int where, const std::string& what) const {
    throw BadData(tree->name + ":" + std::to_string(where), what);
  }

  // Throws, unless all mistakes are collected.
  void complain(int where, const std::string& what) const {
    YamlProblems* const all = YamlProblems::current();
    if (all == nullptr) fail_at(where, what);
    if (!absent) all->note(tree->name + ":" + std::to_string(where) + ": " + what);
  }

  std::string full(const std::string& key) const {
    return path.empty() ? printable(key) : path + "." + printable(key);
  }

  // nullptr where the key is absent. The key counts as asked for.
  const YamlEntry* find(const std::string& key) {
    asked.insert(key);
    const auto entry = node->entries.find(key);
    return entry == node->entries.end() ? nullptr : &entry->second;
  }

  // nullptr where it is missing, and all mistakes are collected.
  const YamlEntry* get(const std::string& key, const std::string& expected) {
    const YamlEntry* const entry = find(key);
    if (entry == nullptr) complain(line, full(key) + ": is missing, expected " + expected);
    return entry;
  }

  // Whether there is no problem.
  bool require(const YamlEntry& entry, const std::string& key, const std::string& problem) const {
    if (!problem.empty()) complain(entry.line, full(key) + " = " + shown(*entry.value) + ": " + problem);
    return problem.empty();
  }

  // nullptr as get().
  const YamlNode* get_list(const std::string& key, const std::string& expected) {
    const YamlEntry* const entry = get(key, expected);
    if (!entry || !require(*entry, key, entry->value->kind == Kind::list ? "" : "must be " + expected))
      return nullptr;
    return entry->value;
  }

  bool require_item(const std::string& key, std::size_t index, const YamlNode& item,
                    const std::string& problem) const {
    if (!problem.empty()) complain(item.line, item_path(key, index) + " = " + shown(item) + ": " + problem);
    return problem.empty();
  }

  // A map without anything, instead of one that is missing.
  std::shared_ptr<Impl> no_map(const std::string& key) const {
    static const YamlNode kEmpty = [] {
      YamlNode empty;
      empty.kind = Kind::map;
      return empty;
    }();
    auto none = std::make_shared<Impl>();
    none->tree = tree;
    none->node = &kEmpty;
    none->path = full(key);
    none->line = line;
    none->absent = true;
    return none;
  }

  std::string item_path(const std::string& key, std::size_t index) const {
    return full(key) + "[" + std::to_string(index) + "]";
  }

  std::shared_ptr<Impl> child(const std::string& key, std::size_t index, const YamlNode& value,
                              std::string child_path, int child_line) {
    std::shared_ptr<Impl>& place = children[{key, index}];
    if (!place) {
      place = std::make_shared<Impl>();
      place->tree = tree;
      place->node = &value;
      place->path = std::move(child_path);
      place->line = child_line;
    }
    return place;
  }

  std::shared_ptr<Impl> map_child(const std::string& key, const YamlEntry& entry) {
    if (!require(entry, key, entry.value->kind == Kind::map ? "" : "must be a map")) return no_map(key);
    return child(key, 0, *entry.value, full(key), entry.line);
  }

  // The map that is a number with what is known of it; nullptr: it is none.
  std::shared_ptr<Impl> known_number(const std::string& key, const YamlEntry& entry) {
    if (entry.value->kind != Kind::map || entry.value->entries.count("value") == 0) return nullptr;
    return map_child(key, entry);
  }

  void complain_of(const std::pair<const std::string, YamlEntry>& unknown) const {
    complain(unknown.second.line,
             full(unknown.first) + " = " + shown(*unknown.second.value) +
                 ": unknown key, known here: " + (asked.empty() ? "none" : joined(asked)));
  }

  void finish() const {
    if (unused_uncertainty)
      complain(line, path + ": nothing uses the uncertainty of this value, give a number");
    const std::pair<const std::string, YamlEntry>* unknown = nullptr;  // the first in the file
    for (const auto& entry : node->entries) {
      if (asked.count(entry.first) != 0) continue;
      if (unknown == nullptr || entry.second.line < unknown->second.line) unknown = &entry;
    }
    if (unknown != nullptr && YamlProblems::current() == nullptr) complain_of(*unknown);
    for (const auto& entry : node->entries)
      if (asked.count(entry.first) == 0) complain_of(entry);
    for (const auto& [place, reader] : children) reader->finish();
  }
};

YamlReader YamlReader::from_file(const std::string& path) {
  return from_text(read_start(path, kLargestYaml + 1), path);  // one more than the parser takes
}

YamlReader YamlReader::from_text(const std::string& text, const std::string& name) {
  auto impl = std::make_shared<Impl>();
  impl->tree = std::make_shared<const YamlTree>(parse_yaml(text, name));
  impl->node = impl->tree->root;
  impl->line = impl->node->line;
  return YamlReader(std::move(impl));
}

YamlReader::YamlReader(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
YamlReader::~YamlReader() = default;
YamlReader::YamlReader(const YamlReader&) = default;
YamlReader& YamlReader::operator=(const YamlReader&) = default;

bool YamlReader::has(const std::string& key) const {
  return impl_->find(key) != nullptr;
}

std::vector<std::string> YamlReader::keys() const {
  std::vector<std::string> names;
  for (const auto& [name, entry] : impl_->node->entries) names.push_back(name);
  const auto line = [this](const std::string& name) { return impl_->node->entries.at(name).line; };
  std::stable_sort(names.begin(), names.end(),
                   [&](const std::string& a, const std::string& b) { return line(a) < line(b); });
  return names;
}

bool YamlReader::is_text(const std::string& key) const {
  const YamlEntry* const entry = impl_->find(key);
  return entry != nullptr && (entry->value->kind == Kind::plain || entry->value->kind == Kind::quoted);
}

double YamlReader::number(const std::string& key, const Range& range) const {
  const YamlEntry* const entry = impl_->get(key, "a number");
  if (!entry) return some_number(range);
  if (const auto known = impl_->known_number(key, *entry)) {
    const YamlReader reader(known);
    if (known->asked.empty()) known->unused_uncertainty = true;
    Uncertainty u;
    const YamlEntry* const said = known->get("uncertainty", "one standard deviation");
    if (said) known->require(*said, "uncertainty", uncertainty_problem(*said->value, u));
    reader.text_or("source", "");
    return reader.number("value", range);
  }
  double value = 0;
  return impl_->require(*entry, key, number_problem(*entry->value, range, value)) ? value
                                                                                  : some_number(range);
}

std::optional<Uncertainty> YamlReader::uncertainty(const std::string& key) const {
  const YamlEntry* const entry = impl_->find(key);
  const auto known = entry == nullptr ? nullptr : impl_->known_number(key, *entry);
  if (!known) return std::nullopt;
  Uncertainty u;
  known->unused_uncertainty = false;
  const YamlEntry* const said = known->get("uncertainty", "one standard deviation");
  if (!said || !known->require(*said, "uncertainty", uncertainty_problem(*said->value, u)))
    return std::nullopt;
  return u;
}

bool YamlReader::is_map(const std::string& key) const {
  const YamlEntry* const entry = impl_->find(key);
  return entry != nullptr && entry->value->kind == Kind::map && entry->value->entries.count("value") == 0;
}

long YamlReader::integer(const std::string& key, long lower, long upper) const {
  const long some = std::clamp(1L, lower, upper);
  const YamlEntry* const entry = impl_->get(key, "an integer");
  if (!entry || !impl_->require(*entry, key, scalar_problem(*entry->value, "an integer"))) return some;
  const std::string& text = entry->value->scalar;
  const char* const end = text.data() + text.size();
  const bool plus = text.size() > 1 && text[0] == '+' && text[1] != '-';
  long value = 0;
  const auto result = std::from_chars(text.data() + (plus ? 1 : 0), end, value);
  const bool is_integer = result.ec != std::errc::invalid_argument && result.ptr == end;
  if (is_integer && result.ec == std::errc() && value >= lower && value <= upper) return value;
  std::string limit = is_integer ? "must be " : "must be an integer ";
  limit += ">= " + std::to_string(lower);
  if (upper < std::numeric_limits<long>::max()) limit += " and <= " + std::to_string(upper);
  impl_->require(*entry, key, limit);
  return some;
}

bool YamlReader::boolean(const std::string& key) const {
  const YamlEntry* const entry = impl_->get(key, "true or false");
  if (!entry || !impl_->require(*entry, key, scalar_problem(*entry->value, "true or false"))) return false;
  const bool value = entry->value->scalar == "true";
  impl_->require(*entry, key, value || entry->value->scalar == "false" ? "" : "must be true or false");
  return value;
}

std::string YamlReader::text(const std::string& key) const {
  const YamlEntry* const entry = impl_->get(key, "text");
  if (!entry || !impl_->require(*entry, key, text_problem(*entry->value))) return "";
  return entry->value->scalar;
}

std::string YamlReader::choice(const std::string& key, const std::vector<std::string>& allowed) const {
  const YamlEntry* const entry = impl_->get(key, "one of " + joined(allowed));
  if (!entry) return allowed.front();
  const bool known = text_problem(*entry->value).empty() &&
                     std::find(allowed.begin(), allowed.end(), entry->value->scalar) != allowed.end();
  return impl_->require(*entry, key, known ? "" : "must be one of " + joined(allowed)) ? entry->value->scalar
                                                                                       : allowed.front();
}

std::vector<double> YamlReader::numbers(const std::string& key, const Range& range) const {
  const YamlNode* const list = impl_->get_list(key, "a list of numbers");
  if (!list) return {};
  std::vector<double> values(list->items.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const YamlNode& item = *list->items[i];
    if (!impl_->require_item(key, i, item, number_problem(item, range, values[i])))
      values[i] = some_number(range);
  }
  return values;
}

std::vector<std::string> YamlReader::texts(const std::string& key) const {
  const YamlNode* const list = impl_->get_list(key, "a list of texts");
  std::vector<std::string> values;
  for (std::size_t i = 0; list && i < list->items.size(); ++i) {
    impl_->require_item(key, i, *list->items[i], text_problem(*list->items[i]));
    values.push_back(list->items[i]->scalar);
  }
  return values;
}

double YamlReader::number_or(const std::string& key, double absent, const Range& range) const {
  return has(key) ? number(key, range) : absent;
}

long YamlReader::integer_or(const std::string& key, long absent, long lower, long upper) const {
  return has(key) ? integer(key, lower, upper) : absent;
}

bool YamlReader::boolean_or(const std::string& key, bool absent) const {
  return has(key) ? boolean(key) : absent;
}

std::string YamlReader::text_or(const std::string& key, const std::string& absent) const {
  return has(key) ? text(key) : absent;
}

YamlReader YamlReader::map(const std::string& key) const {
  const YamlEntry* const entry = impl_->get(key, "a map");
  return YamlReader(entry ? impl_->map_child(key, *entry) : impl_->no_map(key));
}

std::optional<YamlReader> YamlReader::optional_map(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  return map(key);
}

std::vector<YamlReader> YamlReader::maps(const std::string& key) const {
  const YamlNode* const list = impl_->get_list(key, "a list of maps");
  std::vector<YamlReader> readers;
  for (std::size_t i = 0; list && i < list->items.size(); ++i) {
    const YamlNode& item = *list->items[i];
    if (!impl_->require_item(key, i, item, item.kind == Kind::map ? "" : "must be a map")) continue;
    readers.push_back(YamlReader(impl_->child(key, i, item, impl_->item_path(key, i), item.line)));
  }
  return readers;
}

void YamlReader::ignore(const std::string& key) const {
  impl_->asked.insert(key);
}

void YamlReader::finish() const {
  impl_->finish();
}

void YamlReader::fail(const std::string& key, const std::string& reason) const {
  const auto entry = impl_->node->entries.find(key);
  if (entry == impl_->node->entries.end()) impl_->fail_at(impl_->line, impl_->full(key) + ": " + reason);
  impl_->fail_at(entry->second.line, impl_->full(key) + " = " + shown(*entry->second.value) + ": " + reason);
}

const std::string& YamlReader::source() const {
  return impl_->tree->name;
}

}  // namespace backlash
