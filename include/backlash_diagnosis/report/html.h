// SPDX-License-Identifier: BSD-3-Clause
// Pieces of HTML. Text that comes from files or users goes through html_text(), everything else is HTML
// already.
#pragma once

#include <string>
#include <vector>

namespace backlash {

/// With the characters that HTML takes for its own replaced.
std::string html_text(const std::string& text);

/// An element of that name, around the content.
std::string html_tag(const std::string& name, const std::string& content, const std::string& attributes = "");

/// A cell of a table; `kind` is its class.
std::string html_cell(const std::string& content, const std::string& kind = "");

/// A row of a table, from cells.
std::string html_row(const std::string& cells);

/// A row of headings.
std::string html_heads(const std::vector<std::string>& names);

/// A table, which scrolls where the page is narrower than it.
std::string html_table(const std::string& rows, const std::string& kind = "");

}  // namespace backlash
