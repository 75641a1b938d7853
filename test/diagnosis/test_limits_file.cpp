// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/limits.h"

namespace backlash::diagnosis {
namespace {

class LimitsFile : public ::testing::Test {
 protected:
  Limits read(const std::string& text) {
    std::ofstream(path_) << text;
    return read_limits_file(path_);
  }
  void TearDown() override { std::remove(path_.c_str()); }

  const std::string path_ = ::testing::TempDir() + "/limits.yaml";
};

TEST_F(LimitsFile, IsAFileOfItsOwn) {
  const Limits limits = read("schema_version: 1\nbacklash: {watch: 1e-4, service: 2e-4, stop: 3e-4}\n");
  EXPECT_FALSE(limits.angular);
  EXPECT_EQ(limits.watch, 1e-4);
  EXPECT_EQ(limits.stop, 3e-4);
  EXPECT_TRUE(read("schema_version: 1\nbacklash_angle: {watch: 1, service: 2, stop: 3}\n").angular);
}

TEST_F(LimitsFile, IsReadStrictly) {
  EXPECT_THROW(read_limits_file("/nowhere/limits.yaml"), MissingInput);
  const std::string map = "backlash: {watch: 1, service: 2, stop: 3}\n";
  for (const std::string& text :
       {map, "schema_version: 2\n" + map, "schema_version: 1\n" + map + "backlash_angle: {watch: 1}\n",
        "schema_version: 1\n" + map + "grade: 1\n", std::string("schema_version: 1\n"),
        std::string("schema_version: 1\nbacklash: {watch: 3, service: 2, stop: 3}\n")})
    EXPECT_THROW(read(text), BadData) << text;
}

TEST(LimitsCheck, LimitsInMetresCannotGradeAnAngle) {
  const Limits length = {false, 1, 2, 3}, angle = {true, 1, 2, 3};
  EXPECT_NO_THROW(check_limits(length, false, "l.yaml"));
  EXPECT_NO_THROW(check_limits(angle, false, "l.yaml"));
  EXPECT_NO_THROW(check_limits(angle, true, "l.yaml"));
  try {
    check_limits(length, true, "l.yaml");
    ADD_FAILURE() << "accepted";
  } catch (const BadData& error) {
    EXPECT_NE(std::string(error.what()).find("l.yaml: "), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("backlash_angle"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace backlash::diagnosis
