// SPDX-License-Identifier: BSD-3-Clause
// Records of a surgical tool with a torque sensor behind the gear. Oracle: what the records show without any
// model, see doc/measured/mis_tool.md.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "../support/data.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::studies {
namespace {

TEST(MeasuredTool, ABentSpringWithFrictionIsNotCalledPlay) {
  const rig_file::RigFile file = rig_file::load_rig_file(test::package_file("config/mis_tool.yaml"));
  for (const std::string number : {"02", "12", "22"}) {
    const auto path = test::find_data("measured/mis_tool_4_maryland_l_2_" + number + ".csv");
    if (!path) GTEST_SKIP() << "no measured records of the surgical tool";
    const record::Record record = record::read_csv(*path);
    ASSERT_EQ(record.column(record::Channel::output_torque).size(), record.size());
    const diagnosis::Estimate e =
        diagnosis::estimate_position_difference(record, *file.diagnosis.position_difference);
    // Motor minus load changes by 0.95 deg at one end and 1.4 to 1.6 deg at the other, while the torque falls
    // all the way: neither is a free play.
    EXPECT_NE(e.status, diagnosis::Status::ok) << e.message;
    EXPECT_FALSE(e.message.empty());
  }
}

}  // namespace
}  // namespace backlash::studies
