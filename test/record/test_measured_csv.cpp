// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/csv.h"

#ifndef BACKLASH_DIAGNOSIS_SOURCE_DIR
#define BACKLASH_DIAGNOSIS_SOURCE_DIR "."
#endif

namespace backlash::record {
namespace {

namespace fs = std::filesystem;

fs::path measured_data() {
  const char* const given = std::getenv("BACKLASH_DIAGNOSIS_DATA");
  return given != nullptr ? fs::path(given)
                          : fs::path(BACKLASH_DIAGNOSIS_SOURCE_DIR) / ".." / "shared" / "data";
}

/// The first column that is neither time nor a channel: another joint's ("elbow/motor_position"), another
/// sensor's.
std::string unknown_column(const std::string& header) {
  std::istringstream columns(header);
  for (std::string name; std::getline(columns, name, ',');) {
    while (!name.empty() && name.back() == '\r') name.pop_back();
    const auto is_it = [&](Channel channel) { return channel_name(channel) == name; };
    if (name != "time" && std::none_of(kChannels.begin(), kChannels.end(), is_it)) return name;
  }
  return "";
}

TEST(Csv, MeasuredRecordsAreReadWhole) {
  const fs::path folder = measured_data();
  if (!fs::is_directory(folder)) GTEST_SKIP() << "no measured data at " << folder;
  std::size_t count = 0;
  for (auto at = fs::recursive_directory_iterator(folder); at != fs::recursive_directory_iterator(); ++at) {
    const fs::directory_entry& entry = *at;
    if (entry.path().filename() == "raw") at.disable_recursion_pending();  // in the formats of their makers
    if (entry.path().extension() != ".csv") continue;
    std::ifstream in(entry.path());
    std::string line;
    std::size_t lines = 0;
    std::string header;
    while (std::getline(in, line)) {
      if (lines++ == 0) header = line;
    }
    if (header.find('/') != std::string::npos) {
      const std::vector<JointRecord> joints = read_joints_csv(entry.path().string());
      EXPECT_GT(joints.size(), 1u);
      for (const JointRecord& joint : joints) {
        EXPECT_EQ(joint.record.size() + 1, lines) << entry.path();
        EXPECT_NE(header.find(joint.joint + "/motor_position"), std::string::npos) << entry.path();
        EXPECT_EQ(record_of_joint(joints, joint.joint, "x").time, joint.record.time);
      }
      EXPECT_THROW(read_csv(entry.path().string()), BadData);
      continue;
    }
    if (const std::string unknown = unknown_column(header); !unknown.empty()) {
      try {
        read_csv(entry.path().string());
        ADD_FAILURE() << entry.path() << " has the column " << unknown;
      } catch (const BadData& error) {
        EXPECT_NE(std::string(error.what()).find(unknown), std::string::npos) << error.what();
      }
      continue;
    }
    const Record record = read_csv(entry.path().string());
    EXPECT_EQ(record.size() + 1, lines) << entry.path();  // none of them has repeated stamps
    EXPECT_GT(record.sampling_interval(), 0) << entry.path();
    ++count;
  }
  EXPECT_GT(count, 0u);
}

}  // namespace
}  // namespace backlash::record
