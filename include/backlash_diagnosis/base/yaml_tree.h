// SPDX-License-Identifier: BSD-3-Clause
// A YAML document as a plain tree with line numbers: what YamlReader reads. Stricter than YAML: one document
// with a map at the top, text keys without duplicates, no tags, no cycles, bounded size and depth.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <string>
#include <vector>

namespace backlash {

struct YamlNode;

struct YamlEntry {
  int line = 0;  ///< of the key, from 1
  const YamlNode* value = nullptr;
};

struct YamlNode {
  enum class Kind { null, plain, quoted, list, map };  ///< plain and quoted are scalars
  Kind kind = Kind::null;
  int line = 0;                              ///< from 1
  int column = 0;                            ///< from 0, bytes: where it begins on that line
  bool flow = false;                         ///< list and map: in brackets, not by indentation
  std::string scalar;                        ///< plain and quoted
  std::vector<const YamlNode*> items;        ///< list
  std::map<std::string, YamlEntry> entries;  ///< map
};

constexpr std::size_t kDeepestYaml = 64;                            ///< nested lists and maps
constexpr std::size_t kLargestYaml = std::size_t{4} * 1024 * 1024;  ///< bytes

struct YamlTree {
  std::string name;            ///< of the file
  std::deque<YamlNode> nodes;  ///< owns all; an alias is a second pointer to the same node
  const YamlNode* root = nullptr;
};

/// Throws BadData "name:line: reason" for all that is not such a document.
YamlTree parse_yaml(const std::string& text, const std::string& name);

}  // namespace backlash
