// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "report/json.h"

namespace backlash::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(),
                 kInf = std::numeric_limits<double>::infinity();

TEST(JsonNumber, WhatIsNoNumberIsNull) {
  EXPECT_EQ(json_number(0.1).dump(), "0.1");
  EXPECT_EQ(json_number(kNan).dump(), "null");
  EXPECT_EQ(json_number(-kInf).dump(), "null");
}

TEST(JsonNumber, IntervalsMayBeOpen) {
  EXPECT_EQ(json_interval(1, 2).dump(), "[1.0,2.0]");
  EXPECT_EQ(json_interval(1, kInf).dump(), "[1.0,null]");
  EXPECT_EQ(json_interval(kNan, kNan).dump(), "null");
}

}  // namespace
}  // namespace backlash::report
