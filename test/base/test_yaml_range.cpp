// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash {
namespace {

TEST(Range, TextNamesTheBoundsAndContainsKeepsThem) {
  constexpr double kHuge = std::numeric_limits<double>::infinity();
  EXPECT_EQ(Range::any().text(), "must be finite");
  EXPECT_EQ(Range::positive().text(), "must be > 0");
  EXPECT_EQ(Range::not_negative().text(), "must be >= 0");
  EXPECT_EQ(Range::between(-1, 0.5).text(), "must be >= -1 and <= 0.5");
  EXPECT_EQ((Range{-kHuge, 2}).text(), "must be <= 2");
  EXPECT_EQ((Range{0, 2, true}).text(), "must be > 0 and <= 2");
  EXPECT_FALSE(Range::positive().contains(0));
  EXPECT_TRUE(Range::positive().contains(5e-324));
  EXPECT_TRUE(Range::not_negative().contains(0));
  EXPECT_FALSE(Range::not_negative().contains(-5e-324));
  EXPECT_TRUE(Range::between(-1, 0.5).contains(-1));
  EXPECT_TRUE(Range::between(-1, 0.5).contains(0.5));
  EXPECT_FALSE(Range::between(-1, 0.5).contains(0.6));
  EXPECT_FALSE(Range::any().contains(std::nan("")));
  EXPECT_FALSE(Range::any().contains(kHuge));
}

}  // namespace
}  // namespace backlash
