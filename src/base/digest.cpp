// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/digest.h"

#include <cstdint>
#include <vector>

#include "backlash_diagnosis/base/file.h"

namespace backlash {
namespace {

class Fnv1a {
 public:
  void add(std::string_view content) {
    for (const unsigned char c : content) hash_ = (hash_ ^ c) * 1099511628211ULL;
  }
  std::string text() const {
    static const char* const hex = "0123456789abcdef";
    std::string digest;
    for (int shift = 60; shift >= 0; shift -= 4) digest += hex[(hash_ >> shift) & 15];
    return digest;
  }

 private:
  std::uint64_t hash_ = 14695981039346656037ULL;
};

}  // namespace

std::string digest_of(std::string_view content) {
  Fnv1a digest;
  digest.add(content);
  return digest.text();
}

std::string file_digest(const std::string& path) {
  std::ifstream in = open_input(path);
  std::vector<char> part(1 << 16);  // a bag may be larger than the memory
  Fnv1a digest;
  while (in.read(part.data(), std::streamsize(part.size())), in.gcount() > 0)
    digest.add({part.data(), std::size_t(in.gcount())});
  return digest.text();
}

}  // namespace backlash
