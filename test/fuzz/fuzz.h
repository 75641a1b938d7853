// SPDX-License-Identifier: BSD-3-Clause
// What the fuzzers share: input is either read or refused on purpose, with a message that an operator can
// read.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "backlash_diagnosis/base/error.h"

namespace backlash::fuzz {

/// libFuzzer keeps the input that came here.
[[noreturn]] inline void broken(const std::string& what) {
  std::fprintf(stderr, "BROKEN: %s\n", what.c_str());
  std::abort();
}

inline void require(bool holds, const std::string& what) {
  if (!holds) broken(what);
}

/// Runs `read`; whatever is no Error of this package gets through to libFuzzer, which takes it for a crash.
template <typename Read>
void read_or_refuse(const std::string& source, const Read& read) {
  try {
    read();
  } catch (const Error& error) {
    const std::string message = error.what();
    require(message.find(source) != std::string::npos, "the message does not name its source: " + message);
    require(message.size() < 10'000, "a message of " + std::to_string(message.size()) + " bytes");
    for (const char c : message)
      require(static_cast<unsigned char>(c) >= 0x20 || c == '\n', "a control character in: " + message);
  }
}

}  // namespace backlash::fuzz
