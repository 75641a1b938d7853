// SPDX-License-Identifier: BSD-3-Clause
// One file of a recording.
#pragma once

#include "backlash_diagnosis/recording/recording.h"

namespace backlash::recording {

/// The largest chunk or message that is taken: what a damaged length may make us reserve. A choice; recorders
/// write chunks of about 1 MB.
constexpr std::uint64_t kMostBytes = 256u << 20;

std::unique_ptr<Recording> open_mcap(const std::string& path);
std::unique_ptr<Recording> open_sqlite(const std::string& path);

}  // namespace backlash::recording
