// SPDX-License-Identifier: BSD-3-Clause
// Digests of file contents, to see whether two files are the same. Not cryptographic.
#pragma once

#include <string>
#include <string_view>

namespace backlash {

/// 64-bit FNV-1a, as 16 hexadecimal digits.
std::string digest_of(std::string_view content);

/// The same of a file's content. Throws MissingInput.
std::string file_digest(const std::string& path);

}  // namespace backlash
