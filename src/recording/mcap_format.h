// SPDX-License-Identifier: BSD-3-Clause
// Words of the MCAP format (mcap.dev/spec, version 0). A file is: magic, records, magic; a record is one byte
// of opcode, eight of length, content. All numbers are little endian, as this machine is.
#pragma once

#include <array>
#include <cstdint>

namespace backlash::recording {

constexpr std::array<char, 8> kMagic = {'\x89', 'M', 'C', 'A', 'P', '0', '\r', '\n'};
constexpr std::uint64_t kRecordHead = 9;  // bytes of opcode and length

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

}  // namespace backlash::recording
