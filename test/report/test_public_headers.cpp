// SPDX-License-Identifier: BSD-3-Clause
// Who uses the package needs no JSON library to read its headers.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace backlash::report {
namespace {

TEST(PublicHeaders, IncludeNoJsonLibrary) {
  int headers = 0;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(BACKLASH_DIAGNOSIS_SOURCE_DIR "/include")) {
    if (entry.path().extension() != ".h") continue;
    ++headers;
    std::ifstream in(entry.path());
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    EXPECT_EQ(text.find("nlohmann"), std::string::npos) << entry.path();
  }
  EXPECT_GT(headers, 100);
}

}  // namespace
}  // namespace backlash::report
