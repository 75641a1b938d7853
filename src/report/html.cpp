// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/html.h"

namespace backlash {

std::string html_text(const std::string& text) {
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

std::string html_tag(const std::string& name, const std::string& content, const std::string& attributes) {
  return "<" + name + (attributes.empty() ? "" : " " + attributes) + ">" + content + "</" + name + ">";
}

std::string html_cell(const std::string& content, const std::string& kind) {
  return html_tag("td", content, kind.empty() ? "" : "class=\"" + kind + "\"");
}

std::string html_row(const std::string& cells) {
  return html_tag("tr", cells) + "\n";
}

std::string html_heads(const std::vector<std::string>& names) {
  std::string cells;
  for (const std::string& name : names) cells += html_tag("th", name);
  return html_row(cells);
}

std::string html_table(const std::string& rows, const std::string& kind) {
  return html_tag("div", html_tag("table", rows, kind.empty() ? "" : "class=\"" + kind + "\""),
                  "class=\"scroll\"") +
         "\n";
}

}  // namespace backlash
