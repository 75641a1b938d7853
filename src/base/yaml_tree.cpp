// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/yaml_tree.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash {
namespace {

using Kind = YamlNode::Kind;

[[noreturn]] void fail(const std::string& name, int line, const std::string& reason) {
  throw BadData(name + ":" + std::to_string(std::max(1, line)), reason);
}

// Builds the tree from the events of the parser instead of YAML::Load, which keeps duplicate keys, follows
// cycles and recurses as deep as the document says.
class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(YamlTree& tree) : tree_(tree) {}

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (expects_key()) fail_at(mark, "an empty key");
    attach(create(Kind::null, mark, anchor));
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (expects_key()) fail_at(mark, "an alias as key");
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end()) fail_at(mark, "an alias without its anchor");
    const YamlNode* const node = found->second;
    for (const Frame& frame : open_) {
      if (frame.node == node) fail_at(mark, "an alias to a list or map that it is itself part of");
    }
    attach(node);
  }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    refuse_tag(mark, tag);
    if (expects_key()) {
      begin_entry(mark, value);
      return;
    }
    YamlNode* const node = create(tag == "!" ? Kind::quoted : Kind::plain, mark, anchor);
    node->scalar = value;
    attach(node);
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value style) override {
    open(Kind::list, mark, tag, anchor, style);
  }

  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value style) override {
    open(Kind::map, mark, tag, anchor, style);
  }

  void OnSequenceEnd() override { open_.pop_back(); }
  void OnMapEnd() override { open_.pop_back(); }

 private:
  struct Frame {
    YamlNode* node;
    YamlEntry* entry;  // of a map: waits for its value; nullptr while a key is expected
  };

  [[noreturn]] void fail_at(const YAML::Mark& mark, const std::string& reason) const {
    fail(tree_.name, mark.line + 1, reason);
  }

  bool expects_key() const {
    return !open_.empty() && open_.back().node->kind == Kind::map && open_.back().entry == nullptr;
  }

  // The parser marks plain text, lists and maps with "?" or nothing and quoted text with "!".
  void refuse_tag(const YAML::Mark& mark, const std::string& tag) const {
    if (!tag.empty() && tag != "?" && tag != "!")
      fail_at(mark, "tag '" + printable(tag) + "' is not supported");
  }

  void begin_entry(const YAML::Mark& mark, const std::string& key) {
    const auto [place, is_new] = open_.back().node->entries.try_emplace(key);
    if (!is_new) {
      fail_at(mark, "key '" + printable(key) + "': there twice, first in line " +
                        std::to_string(place->second.line));
    }
    place->second.line = mark.line + 1;
    open_.back().entry = &place->second;
  }

  void open(Kind kind, const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
            YAML::EmitterStyle::value style) {
    refuse_tag(mark, tag);
    if (expects_key()) fail_at(mark, "a list or map as key");
    if (open_.size() == kDeepestYaml) {
      fail_at(mark, "nested deeper than " + std::to_string(kDeepestYaml) + " levels");
    }
    YamlNode* const node = create(kind, mark, anchor);
    node->flow = style == YAML::EmitterStyle::Flow;
    attach(node);
    open_.push_back({node, nullptr});
  }

  YamlNode* create(Kind kind, const YAML::Mark& mark, YAML::anchor_t anchor) {
    YamlNode& node = tree_.nodes.emplace_back();
    node.kind = kind;
    node.line = mark.line + 1;
    node.column = mark.column;
    if (anchor != 0) anchors_[anchor] = &node;
    return &node;
  }

  void attach(const YamlNode* node) {
    if (open_.empty()) {
      tree_.root = node;
    } else if (open_.back().node->kind == Kind::list) {
      open_.back().node->items.push_back(node);
    } else {
      open_.back().entry->value = node;
      open_.back().entry = nullptr;
    }
  }

  YamlTree& tree_;
  std::vector<Frame> open_;
  std::map<YAML::anchor_t, const YamlNode*> anchors_;
};

// The parser collects all brackets of a line before it reports the first, so the depth is bounded
// beforehand. Text with as many brackets that never close is refused too.
void refuse_many_open_brackets(const std::string& text, const std::string& name) {
  std::size_t depth = 0;
  int line = 1;
  for (const char c : text) {
    if (c == '\n') ++line;
    if (c == '[' || c == '{') ++depth;
    if ((c == ']' || c == '}') && depth > 0) --depth;
    if (depth > 4 * kDeepestYaml)
      fail(name, line, "nested deeper than " + std::to_string(kDeepestYaml) + " levels");
  }
}

void refuse_binary(const std::string& text, const std::string& name) {
  int line = 1;
  for (const char c : text) {
    if (c == '\n') ++line;
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 0x20 && c != '\n' && c != '\r' && c != '\t') || byte == 0x7f) {
      fail(name, line,
           "contains the control character " + printable(std::string(1, c)) + ": not a text file in UTF-8");
    }
  }
}

}  // namespace

YamlTree parse_yaml(const std::string& text, const std::string& name) {
  if (text.size() > kLargestYaml) {
    throw BadData(name,
                  "larger than " + std::to_string(kLargestYaml) + " bytes, too large for a configuration");
  }
  refuse_binary(text, name);
  refuse_many_open_brackets(text, name);
  YamlTree tree;
  tree.name = name;
  try {
    // The end mark makes the parser refuse a quote that never closes, which it takes as closed at the end of
    // file.
    std::istringstream stream(text + "\n...\n");
    YAML::Parser parser(stream);
    TreeBuilder builder(tree);
    parser.HandleNextDocument(builder);
    YamlTree rest;
    rest.name = name;
    TreeBuilder rest_builder(rest);
    if (parser.HandleNextDocument(rest_builder)) {
      fail(name, rest.root != nullptr ? rest.root->line : 1, "a second document, expected one");
    }
  } catch (const YAML::Exception& error) {
    const auto lines = static_cast<int>(std::count(text.begin(), text.end(), '\n')) + 1;
    const bool open_quote = error.msg == YAML::ErrorMsg::DOC_IN_SCALAR;
    fail(name, std::min(error.mark.line + 1, lines),
         "not valid YAML: " + (open_quote ? "a quote that never closes" : printable(error.msg, 200)));
  }
  if (tree.root == nullptr || tree.root->kind == Kind::null)
    fail(name, 1, "empty, expected a map of keys and values");
  if (tree.root->kind != Kind::map) fail(name, tree.root->line, "not a map of keys and values");
  return tree;
}

}  // namespace backlash
