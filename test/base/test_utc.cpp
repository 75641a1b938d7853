// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "backlash_diagnosis/base/utc.h"

namespace backlash {
namespace {

// Seconds by `date -u +%s -d DATE`.
TEST(Utc, WritesDatesAfterIso8601) {
  EXPECT_EQ(utc_time(0), "1970-01-01T00:00:00Z");
  EXPECT_EQ(utc_time(1803897005.9), "2027-03-01T10:30:05Z");
  EXPECT_EQ(utc_date(1709208000), "2024-02-29");
  EXPECT_EQ(utc_time(-0.5), "1969-12-31T23:59:59Z");
  EXPECT_EQ(utc_date(-62167219200), "0000-01-01");
  EXPECT_EQ(utc_time(253402300799), "9999-12-31T23:59:59Z");
}

TEST(Utc, IsEmptyWhereThereIsNoSuchDate) {
  for (const double time : {253402300800.0, -62167219201.0, 1e300, std::numeric_limits<double>::infinity(),
                            std::numeric_limits<double>::quiet_NaN()})
    EXPECT_EQ(utc_time(time) + utc_date(time), "") << time;
}

}  // namespace
}  // namespace backlash
