// SPDX-License-Identifier: BSD-3-Clause
// Short names for contents: whether two files are the same, not whether somebody meant them to look the same.
#pragma once

#include <string>
#include <string_view>

namespace backlash {

/// 64-bit FNV-1a, as 16 hexadecimal digits.
std::string digest_of(std::string_view content);

/// The same of a file's content. Throws MissingInput.
std::string file_digest(const std::string& path);

}  // namespace backlash
