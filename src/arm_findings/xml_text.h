// SPDX-License-Identifier: BSD-3-Clause
// An XML document as text whose elements have places: values are written into it, and all else stays byte by
// byte (comments, order, blanks).
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace backlash::arm_findings {

struct XmlElement {
  std::string name;
  std::map<std::string, std::string> attributes;
  std::size_t begin = 0, end = 0;  // of the start tag, in bytes; end: behind ">"
  std::size_t close = 0;           // where the end tag begins; of <a/> that is `end`
  std::size_t line = 0;            // of the start tag, from 1
  std::vector<std::unique_ptr<XmlElement>> children;

  bool is_empty_tag() const { return close == end; }
  const XmlElement* child(const std::string& name) const;  // the first; null: there is none
  std::string attribute(const std::string& name) const;    // empty: there is none
};

/// Throws BadData with the line where the text is no XML. `source` names it.
std::unique_ptr<XmlElement> parse_xml(const std::string& text, const std::string& source);

/// Changes of a text at places that do not overlap.
class TextChanges {
 public:
  explicit TextChanges(const std::string& text) : text_(text) {}
  void replace(std::size_t begin, std::size_t end, const std::string& with);
  /// Writes or adds attributes of an element; one that is there keeps its place. Those of `without` go.
  void set_attributes(const XmlElement& element,
                      const std::vector<std::pair<std::string, std::string>>& values,
                      const std::vector<std::string>& without = {});
  /// Adds lines into an element: behind its start tag, or before its end tag, indented as its children are.
  void add_first(const XmlElement& element, const std::vector<std::string>& lines);
  void add_last(const XmlElement& element, const std::vector<std::string>& lines);

  bool empty() const { return changes_.empty(); }
  std::string result() const;

 private:
  std::string lines_text(const XmlElement& element, const std::vector<std::string>& lines) const;
  std::string indent_of(const XmlElement& element) const;
  void open(const XmlElement& element, const std::string& inside);

  const std::string& text_;
  std::map<std::size_t, std::pair<std::size_t, std::string>> changes_;  // begin: end, new text
};

}  // namespace backlash::arm_findings
