// SPDX-License-Identifier: BSD-3-Clause
// What plan_motion reports of a planned motion.
#pragma once

#include <iosfwd>
#include <string>

#include "backlash_diagnosis/geared_arm/motion_plan.h"

namespace backlash::arm_findings {

std::string motion_plan_json(const geared_arm::MotionPlan& plan);
void print_motion_plan(const geared_arm::MotionPlan& plan, std::ostream& out);

}  // namespace backlash::arm_findings
