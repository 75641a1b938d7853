// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>

#include "backlash_diagnosis/base/digest.h"
#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

// Fowler, Noll and Vo's own test vectors for 64-bit FNV-1a (draft-eastlake-fnv, Appendix C).
TEST(Digest, IsFnv1a) {
  EXPECT_EQ(digest_of(""), "cbf29ce484222325");
  EXPECT_EQ(digest_of("a"), "af63dc4c8601ec8c");
  EXPECT_EQ(digest_of("foobar"), "85944171f73967e8");
}

TEST(Digest, OfAFileIsThatOfItsContent) {
  const std::string path = testing::TempDir() + "/digest_of_a_file", content(200'000, '\0');
  std::ofstream(path, std::ios::binary) << content << "end";
  EXPECT_EQ(file_digest(path), digest_of(content + "end"));
  EXPECT_THROW(file_digest(path + "_missing"), MissingInput);
}

}  // namespace
}  // namespace backlash
