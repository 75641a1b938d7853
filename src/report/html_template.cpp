// SPDX-License-Identifier: BSD-3-Clause
#include "html_template.h"

#include <string_view>
#include <vector>

#include "backlash_diagnosis/base/error.h"

namespace backlash::report {
namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

bool shows(const Json* value) {
  if (value == nullptr || value->is_null()) return false;
  if (value->is_boolean()) return value->get<bool>();
  if (value->is_string()) return !value->get_ref<const std::string&>().empty();
  return !value->is_array() || !value->empty();
}

/// One template, read from its beginning to its end.
class Filling {
 public:
  explicit Filling(const Json& data) : scopes_{&data} {}

  std::string of(std::string_view rest) {
    std::string out;
    for (std::size_t at; (at = rest.find("{{")) != std::string_view::npos;) {
      out += rest.substr(0, at);
      rest.remove_prefix(at);
      const bool raw = rest.substr(0, 3) == "{{{";
      const std::string tag = cut(rest, raw ? "{{{" : "{{", raw ? "}}}" : "}}");
      if (!raw && (tag.front() == '#' || tag.front() == '^'))
        out += section(tag.front() == '#', tag.substr(1), rest);
      else
        out += raw ? text(tag) : escaped(text(tag));
    }
    return out.append(rest);
  }

 private:
  /// What stands between the marks at the beginning of `rest`, which begins behind them then.
  static std::string cut(std::string_view& rest, std::string_view open, std::string_view close) {
    const std::size_t end = rest.find(close);
    if (end == std::string_view::npos || end == open.size())
      throw Error("template: a tag without end or name");
    const std::string tag(rest.substr(open.size(), end - open.size()));
    rest.remove_prefix(end + close.size());
    return tag;
  }

  static void skip_newline(std::string_view& rest) {
    if (!rest.empty() && rest.front() == '\n') rest.remove_prefix(1);
  }

  std::string section(bool wanted, const std::string& name, std::string_view& rest) {
    const std::string end = "{{/" + name + "}}";
    const std::size_t at = rest.find(end);
    if (at == std::string_view::npos) throw Error("template: section " + name + " does not end");
    std::string_view inside = rest.substr(0, at);
    rest.remove_prefix(at + end.size());
    if (!inside.empty() && inside.front() == '\n') skip_newline(rest);
    skip_newline(inside);
    const Json* value = find(name);
    if (shows(value) != wanted) return "";
    if (!wanted) return of(inside);
    if (!value->is_array()) return of(inside, *value);
    std::string out;
    for (const Json& item : *value) out += of(inside, item);
    return out;
  }

  std::string of(std::string_view inside, const Json& scope) {
    scopes_.push_back(&scope);
    const std::string out = of(inside);
    scopes_.pop_back();
    return out;
  }

  const Json* find(const std::string& name) const {
    if (name == ".") return scopes_.back();
    for (auto scope = scopes_.rbegin(); scope != scopes_.rend(); ++scope)
      if ((*scope)->is_object() && (*scope)->contains(name)) return &(**scope)[name];
    return nullptr;
  }

  std::string text(const std::string& name) const {
    const Json* value = find(name);
    if (value == nullptr) throw Error("template: the data has no " + name);
    return value->is_string() ? value->get<std::string>() : value->dump();
  }

  std::vector<const Json*> scopes_;
};

}  // namespace

std::string filled(const std::string& html_template, const Json& data) {
  return Filling(data).of(html_template);
}

}  // namespace backlash::report
