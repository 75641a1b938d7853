// SPDX-License-Identifier: BSD-3-Clause
// Text as it comes from files and as it goes into messages. Independent of the locale.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace backlash {

/// `value`, or the `problem` in a few words ("not a number").
struct ParsedNumber {
  double value = 0;
  const char* problem = nullptr;
  explicit operator bool() const { return problem == nullptr; }
};

/// The whole text as one finite decimal number: "1", "-.5", "+2e-3". No spaces, no hexadecimal, no nan or
/// inf.
ParsedNumber parse_number(std::string_view text);

/// The shortest text that parse_number turns into exactly the same double.
std::string to_text(double value);

/// The text without spaces and tabs at both ends.
std::string_view trimmed(std::string_view text);

/// For messages: control characters and bytes that are not UTF-8 as `\xHH`, cut after `limit` characters with
/// "...".
std::string printable(std::string_view text, std::size_t limit = 60);

/// "a, b, c"
template <typename Strings>
std::string joined(const Strings& parts) {
  std::string text;
  for (const auto& part : parts) {
    if (!text.empty()) text += ", ";
    text += part;
  }
  return text;
}

}  // namespace backlash
