// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/yaml_edit.h"

#include <algorithm>
#include <sstream>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/yaml_tree.h"

namespace backlash {
namespace {

constexpr std::size_t kCommentColumn = 34;

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

std::size_t indent_of(const std::string& line) {
  return line.find_first_not_of(' ');
}

/// Puts `value` where the scalar of "key: scalar  # comment" stands; false where the line is not of that
/// form.
bool replace_scalar(std::string& line, const std::string& key, const std::string& scalar,
                    const std::string& value, const std::string& comment) {
  const std::size_t begin = indent_of(line);
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

}  // namespace

std::string with_yaml_value(const std::string& text, const std::string& name, const std::string& key,
                            const std::string& value, const std::string& comment) {
  const YamlTree tree = parse_yaml(text, name);
  std::vector<std::string> lines = split(text, '\n');
  const std::vector<std::string> path = split(key, '.');
  const YamlNode* map = tree.root;
  for (std::size_t depth = 0; depth < path.size(); ++depth) {
    const auto found = map->entries.find(path[depth]);
    const bool last = depth + 1 == path.size();
    if (found == map->entries.end()) {
      if (!last || map->entries.empty()) throw BadData(name, key + ": its map is missing");
      const auto before = static_cast<std::ptrdiff_t>(map->line) - 1;  // of the first key in the map
      const std::string indent(indent_of(lines.at(before)), ' ');
      lines.insert(lines.begin() + before, with_comment(indent + path[depth] + ": " + value, comment));
      break;
    }
    const YamlEntry& entry = found->second;
    if (!last) {
      if (entry.value->kind != YamlNode::Kind::map)
        throw BadData(name, key + ": " + path[depth] + " is no map");
      map = entry.value;
    } else if (!replace_scalar(lines.at(entry.line - 1), path[depth], entry.value->scalar, value, comment)) {
      throw BadData(name + ":" + std::to_string(entry.line),
                    key + ": is no plain value on a line of its own");
    }
  }
  std::string changed;
  for (const std::string& line : lines) changed += line + '\n';
  return changed;
}

}  // namespace backlash
