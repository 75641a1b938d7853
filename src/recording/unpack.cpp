// SPDX-License-Identifier: BSD-3-Clause
#include "unpack.h"

#include <lz4frame.h>
#include <zstd.h>

#include <memory>
#include <new>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::recording {
namespace {

[[noreturn]] void damaged(const std::string& where, const std::string& how) {
  throw BadData(where, "damaged: the chunk does not unpack (" + how + ") to the size that it states");
}

void unpack_lz4(const std::uint8_t* data, std::size_t bytes, std::size_t size, const std::string& where,
                Bytes& out) {
  out.resize(size + 1);  // one more than wanted, to see a frame that holds too much
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) throw std::bad_alloc();
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context(raw,
                                                                             LZ4F_freeDecompressionContext);
  std::size_t read = 0, written = 0, expected = 1;
  while (expected != 0 && read < bytes) {
    std::size_t in = bytes - read, room = out.size() - written;
    expected = LZ4F_decompress(raw, out.data() + written, &room, data + read, &in, nullptr);
    if (LZ4F_isError(expected)) damaged(where, LZ4F_getErrorName(expected));
    if (in == 0 && room == 0) break;
    read += in;
    written += room;
  }
  if (expected != 0 || read != bytes || written != size) damaged(where, "lz4");
  out.resize(size);
}

void unpack_zstd(const std::uint8_t* data, std::size_t bytes, std::size_t size, const std::string& where,
                 Bytes& out) {
  const auto stated = ZSTD_getFrameContentSize(data, bytes);
  if (stated == ZSTD_CONTENTSIZE_ERROR) damaged(where, "zstd");
  if (stated != ZSTD_CONTENTSIZE_UNKNOWN && stated > size) damaged(where, "zstd");
  out.resize(size);
  const std::size_t written = ZSTD_decompress(out.data(), size, data, bytes);
  if (ZSTD_isError(written)) damaged(where, ZSTD_getErrorName(written));
  if (written != size) damaged(where, "zstd");
}

}  // namespace

void unpack(const std::string& compression, const std::uint8_t* data, std::size_t bytes, std::size_t size,
            const std::string& where, Bytes& to) {
  if (compression == "lz4") return unpack_lz4(data, bytes, size, where, to);
  if (compression == "zstd") return unpack_zstd(data, bytes, size, where, to);
  if (!compression.empty())
    throw BadData(where,
                  "compression '" + printable(compression) + "' cannot be read; lz4, zstd or none can");
  if (bytes != size) damaged(where, "none");
  to.assign(data, data + bytes);
}

}  // namespace backlash::recording
