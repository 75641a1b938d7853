// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/text.h"

#include <fmt/core.h>

#include <charconv>
#include <cmath>

namespace backlash {
namespace {

// YAML writes .nan and .inf, which from_chars does not know.
bool names_not_finite(std::string_view text) {
  if (!text.empty() && text.front() == '.') text.remove_prefix(1);
  std::string lower;
  for (const char c : text.substr(0, 9)) lower += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower == "nan" || lower == "inf" || lower == "infinity";
}

// Number of bytes of the printable character at the start of `text`; 0 where it is a control character or not
// UTF-8.
std::size_t printable_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return lead >= 0x20 && lead != 0x7f ? 1 : 0;
  const std::size_t length = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < length) return 0;
  char32_t code = lead & (0x7fU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
    code = code << 6 | (byte(i) & 0x3fU);
  }
  const char32_t lowest = length == 4 ? 0x10000 : length == 3 ? 0x800 : 0xa0;  // 0x80..0x9f are controls
  const bool surrogate = code >= 0xd800 && code <= 0xdfff;
  return code < lowest || code > 0x10ffff || surrogate ? 0 : length;
}

}  // namespace

ParsedNumber parse_number(std::string_view text) {
  std::string_view digits = text;
  if (!digits.empty() && digits.front() == '+') {
    digits.remove_prefix(1);
    if (!digits.empty() && digits.front() == '-') return {0, "not a number"};
  }
  std::string_view unsigned_part = digits;
  if (!unsigned_part.empty() && unsigned_part.front() == '-') unsigned_part.remove_prefix(1);
  if (names_not_finite(unsigned_part)) return {0, "not a finite number"};

  double value = 0;
  const char* const end = digits.data() + digits.size();
  const auto result = std::from_chars(digits.data(), end, value);
  if (result.ec == std::errc::invalid_argument || result.ptr != end) return {0, "not a number"};
  if (result.ec == std::errc::result_out_of_range) return {0, "too large or too small for a double"};
  if (!std::isfinite(value)) return {0, "not a finite number"};
  return {value, nullptr};
}

std::string to_text(double value) {
  char buffer[32];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  return std::string(buffer, result.ptr);
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::string printable(std::string_view text, std::size_t limit) {
  std::string shown;
  for (std::size_t count = 0; !text.empty(); ++count) {
    if (count == limit) return shown + "...";
    const std::size_t length = printable_length(text);
    if (length > 0) {
      shown.append(text.substr(0, length));
    } else {
      shown += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[0]));
    }
    text.remove_prefix(length > 0 ? length : 1);
  }
  return shown;
}

}  // namespace backlash
