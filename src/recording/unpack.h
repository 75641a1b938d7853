// SPDX-License-Identifier: BSD-3-Clause
// The compressions of the chunks of recordings.
#pragma once

#include <string>

#include "backlash_diagnosis/recording/cdr.h"

namespace backlash::recording {

/// Unpacks into `to`, whose memory is used again; the result has `size` bytes. `compression`: "", "lz4"
/// (frames) or "zstd". Throws BadData with `where` for any other, and where the result is not of that size.
void unpack(const std::string& compression, const std::uint8_t* data, std::size_t bytes, std::size_t size,
            const std::string& where, Bytes& to);

}  // namespace backlash::recording
