// SPDX-License-Identifier: BSD-3-Clause
// A history in a folder of its own, and entries that a number says.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>  // mkdtemp

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/history.h"

namespace backlash::diagnosis {

namespace fs = std::filesystem;

inline HistoryEntry entry(int number) {
  HistoryEntry e;
  e.time = 1.8e9 + 0.1 * number;
  e.grade = "good";
  e.backlash = 1e-4 / 3 + 1e-9 * number;
  e.lower = 0.9 * e.backlash;
  e.upper = 1.1 * e.backlash;
  e.methods = "apd_shape+lost_motion";
  e.rig_digest = "0123456789abcdef";
  return e;
}

inline bool same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

inline void expect_same(const HistoryEntry& a, const HistoryEntry& b) {
  EXPECT_EQ(a.event, b.event);
  EXPECT_EQ(a.grade, b.grade);
  EXPECT_EQ(a.methods, b.methods);
  EXPECT_EQ(a.rig_digest, b.rig_digest);
  for (const auto number : {&HistoryEntry::time, &HistoryEntry::backlash, &HistoryEntry::lower,
                            &HistoryEntry::upper, &HistoryEntry::backlash_angle, &HistoryEntry::angle_lower,
                            &HistoryEntry::angle_upper, &HistoryEntry::skewness})
    EXPECT_TRUE(same(a.*number, b.*number)) << a.*number << " " << b.*number;
}

class HistoryTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "backlash_history_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name = "elbow.csv") const { return (folder_ / name).string(); }
  History history(std::uintmax_t rotate_at = 10'000'000) const { return History({path(), rotate_at}); }

  std::string content(const std::string& name = "elbow.csv") const {
    std::ifstream in(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void put(const std::string& text) const { std::ofstream(path(), std::ios::binary) << text; }

  /// The entries are those of these numbers, in this order.
  void expect_entries(const std::vector<int>& numbers, std::size_t warnings = 0) const {
    const HistoryFile file = read_history(path());
    ASSERT_EQ(file.entries.size(), numbers.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) expect_same(file.entries[i], entry(numbers[i]));
    EXPECT_EQ(file.warnings.size(), warnings);
  }

  template <typename E, typename F>
  static void expect_refusal(F action, const std::string& reason) {
    try {
      action();
      ADD_FAILURE() << "not refused: " << reason;
    } catch (const E& error) {
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  }

  fs::path folder_;
};

}  // namespace backlash::diagnosis
