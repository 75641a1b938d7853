// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/estimate.h"

namespace backlash::diagnosis {
namespace {

TEST(Status, NamesAreTheEnumerators) {
  const std::pair<Status, const char*> names[] = {{Status::ok, "ok"},
                                                  {Status::below_range, "below_range"},
                                                  {Status::above_range, "above_range"},
                                                  {Status::out_of_domain, "out_of_domain"},
                                                  {Status::insufficient_data, "insufficient_data"},
                                                  {Status::ambiguous, "ambiguous"}};
  for (const auto& [status, name] : names) {
    EXPECT_STREQ(to_string(status), name);
    EXPECT_EQ(status_from_string(name), status);
  }
}

TEST(Status, OtherTextIsRefused) {
  for (const std::string text : {"", "OK", "ok ", "fine"}) {
    EXPECT_THROW(status_from_string(text), InvalidParameter) << text;
  }
}

}  // namespace
}  // namespace backlash::diagnosis
