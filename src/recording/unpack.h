// SPDX-License-Identifier: BSD-3-Clause
// The compressions of MCAP chunks.
#pragma once

#include <string>

#include "backlash_diagnosis/recording/cdr.h"

namespace backlash::recording {

/// `compression`: "", "lz4" (frames) or "zstd". Throws BadData with `where` for any other, and where the
/// result is not of `size` bytes.
Bytes unpacked(const std::string& compression, const std::uint8_t* data, std::size_t bytes, std::size_t size,
               const std::string& where);

}  // namespace backlash::recording
