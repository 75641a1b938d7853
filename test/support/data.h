// SPDX-License-Identifier: BSD-3-Clause
// Where tests find their files: measured records that may be absent, and files of the package itself.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

namespace backlash::test {

/// Path of a measured record ("rig/rig_halfgap_30um.csv"): in $BACKLASH_DIAGNOSIS_DATA, else in
/// ../shared/data beside the repository. Without it a test calls GTEST_SKIP with the reason.
inline std::optional<std::string> find_data(const std::string& relative) {
  namespace fs = std::filesystem;
  const char* folder = std::getenv("BACKLASH_DIAGNOSIS_DATA");
  const fs::path fallback = fs::path(BACKLASH_DIAGNOSIS_SOURCE_DIR) / ".." / "shared" / "data";
  for (const fs::path& root : {fs::path(folder ? folder : ""), fallback}) {
    if (!root.empty() && fs::exists(root / relative)) return (root / relative).lexically_normal().string();
  }
  return std::nullopt;
}

/// Path of a file of the package ("config/sarkar_1997.yaml", "test/data/x.bag").
inline std::string package_file(const std::string& relative) {
  return std::string(BACKLASH_DIAGNOSIS_SOURCE_DIR) + "/" + relative;
}

}  // namespace backlash::test
