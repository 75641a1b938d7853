// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <utility>

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
  }
}

}  // namespace
}  // namespace backlash::diagnosis
