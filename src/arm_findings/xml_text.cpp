// SPDX-License-Identifier: BSD-3-Clause
#include "xml_text.h"

#include <expat.h>

#include "backlash_diagnosis/base/error.h"

namespace backlash::arm_findings {
namespace {

struct Reading {
  XML_Parser parser = nullptr;
  XmlElement top;  // the root is its only child
  std::vector<XmlElement*> open = {&top};
};

void XMLCALL started(void* data, const XML_Char* name, const XML_Char** attributes) {
  auto& reading = *static_cast<Reading*>(data);
  auto element = std::make_unique<XmlElement>();
  element->name = name;
  for (; attributes[0] != nullptr; attributes += 2) element->attributes[attributes[0]] = attributes[1];
  element->line = XML_GetCurrentLineNumber(reading.parser);
  element->begin = std::size_t(XML_GetCurrentByteIndex(reading.parser));
  element->end = element->begin + std::size_t(XML_GetCurrentByteCount(reading.parser));
  reading.open.back()->children.push_back(std::move(element));
  reading.open.push_back(reading.open.back()->children.back().get());
}

void XMLCALL ended(void* data, const XML_Char*) {
  auto& reading = *static_cast<Reading*>(data);
  // Of <a/> both events are of the same bytes.
  const auto at = std::size_t(XML_GetCurrentByteIndex(reading.parser));
  XmlElement& element = *reading.open.back();
  element.close = at <= element.begin ? element.end : at;
  reading.open.pop_back();
}

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

/// Where an attribute stands in a start tag: the first byte of its name, and its value between the quotes.
struct Place {
  std::size_t begin = std::string::npos, from = 0, to = 0;  // npos: it is not there
};

Place place_of(const std::string& text, const XmlElement& element, const std::string& name) {
  std::size_t at = element.begin + 1 + element.name.size();
  while (at < element.end) {
    while (at < element.end && is_blank(text[at])) ++at;
    const std::size_t from = at;
    while (at < element.end && !is_blank(text[at]) && text[at] != '=' && text[at] != '/' && text[at] != '>')
      ++at;
    const std::string found = text.substr(from, at - from);
    if (found.empty()) break;
    const std::size_t quote = text.find_first_of("\"'", at);
    const std::size_t last = text.find(text[quote], quote + 1);
    if (found == name) return {from, quote + 1, last};
    at = last + 1;
  }
  return {};
}

}  // namespace

const XmlElement* XmlElement::child(const std::string& wanted) const {
  for (const auto& c : children)
    if (c->name == wanted) return c.get();
  return nullptr;
}

std::string XmlElement::attribute(const std::string& wanted) const {
  const auto found = attributes.find(wanted);
  return found == attributes.end() ? "" : found->second;
}

std::unique_ptr<XmlElement> parse_xml(const std::string& text, const std::string& source) {
  Reading reading;
  const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr),
                                                                       XML_ParserFree);
  reading.parser = parser.get();
  XML_SetUserData(parser.get(), &reading);
  XML_SetElementHandler(parser.get(), started, ended);
  if (XML_Parse(parser.get(), text.data(), int(text.size()), XML_TRUE) != XML_STATUS_OK)
    throw BadData(source, "line " + std::to_string(XML_GetCurrentLineNumber(parser.get())) +
                              ": no XML: " + XML_ErrorString(XML_GetErrorCode(parser.get())));
  return std::move(reading.top.children.front());
}

void TextChanges::replace(std::size_t begin, std::size_t end, const std::string& with) {
  changes_[begin] = {end, with};
}

void TextChanges::set_attributes(const XmlElement& element,
                                 const std::vector<std::pair<std::string, std::string>>& values,
                                 const std::vector<std::string>& without) {
  std::string more;
  for (const auto& [name, value] : values) {
    const Place place = place_of(text_, element, name);
    if (place.begin == std::string::npos)
      more += " " + name + "=\"" + value + "\"";
    else
      replace(place.from, place.to, value);
  }
  for (const std::string& name : without) {
    Place place = place_of(text_, element, name);
    if (place.begin == std::string::npos) continue;
    while (is_blank(text_[place.begin - 1])) --place.begin;
    replace(place.begin, place.to + 1, "");
  }
  if (more.empty()) return;
  std::size_t at = element.end - (text_[element.end - 2] == '/' ? 2 : 1);
  while (is_blank(text_[at - 1])) --at;
  replace(at, at, more);
}

/// The blanks in front of an element on its line.
std::string TextChanges::indent_of(const XmlElement& element) const {
  std::size_t from = element.begin;
  while (from > 0 && (text_[from - 1] == ' ' || text_[from - 1] == '\t')) --from;
  return text_.substr(from, element.begin - from);
}

std::string TextChanges::lines_text(const XmlElement& element, const std::vector<std::string>& lines) const {
  const std::string indent =
      element.children.empty() ? indent_of(element) + "  " : indent_of(*element.children.front());
  std::string all;
  for (const std::string& line : lines) all += "\n" + indent + line;
  return all;
}

/// <a/> becomes <a>...</a>.
void TextChanges::open(const XmlElement& element, const std::string& inside) {
  std::size_t slash = text_.rfind('/', element.end - 1);
  while (is_blank(text_[slash - 1])) --slash;
  replace(slash, element.end, ">" + inside + "\n" + indent_of(element) + "</" + element.name + ">");
}

void TextChanges::add_first(const XmlElement& element, const std::vector<std::string>& lines) {
  if (element.is_empty_tag())
    open(element, lines_text(element, lines));
  else
    replace(element.end, element.end, lines_text(element, lines));
}

void TextChanges::add_last(const XmlElement& element, const std::vector<std::string>& lines) {
  if (element.is_empty_tag()) return open(element, lines_text(element, lines));
  std::size_t at = element.close;
  while (at > element.end && is_blank(text_[at - 1])) --at;
  replace(at, at, lines_text(element, lines));
}

std::string TextChanges::result() const {
  std::string out;
  std::size_t at = 0;
  for (const auto& [begin, change] : changes_) {
    out += text_.substr(at, begin - at) + change.second;
    at = change.first;
  }
  return out + text_.substr(at);
}

}  // namespace backlash::arm_findings
