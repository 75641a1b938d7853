// SPDX-License-Identifier: BSD-3-Clause
// What is loaded and called is tested by the commands and the simulator on arms.
#include <gtest/gtest.h>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/loaded_function.h"

namespace backlash {
namespace {

TEST(LoadedFunction, WhatIsNotBuiltIsNamedWithItsTarget) {
  try {
    address_of("backlash_diagnosis_of_nobody", "anything");
    FAIL();
  } catch (const MissingInput& error) {
    EXPECT_NE(std::string(error.what()).find("build the target backlash_diagnosis_of_nobody"),
              std::string::npos)
        << error.what();
  }
}

TEST(LoadedFunction, AFunctionThatIsNotThereIsRefused) {
  EXPECT_THROW(address_of("backlash_diagnosis_base", "of_nobody"), MissingInput);
}

}  // namespace
}  // namespace backlash
