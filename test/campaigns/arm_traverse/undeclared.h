// SPDX-License-Identifier: BSD-3-Clause
// What a rig file of an arm may not know: of the machine before it is simulated, of its record afterwards.
// A torque that friction, cogging or load would ask of a motor beside the declared ones is added to the
// recorded torque: the motion is then that of such a machine, whose controller gave as much more.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/geared_arm/geared_arm.h"
#include "backlash_diagnosis/record/csv.h"

namespace backlash::geared_arm {

const std::vector<std::string>& undeclared_kinds();

/// Changes links, teeth, friction, controllers. `machine` comes from the rig file.
void change_machine(GearedArm& machine, const std::string& kind, Random& random);

/// Of exact channels motor_torque, motor_position, motor_velocity, output_torque.
void change_record(std::vector<record::JointRecord>& joints, const GearedArm& machine,
                   const std::string& kind, Random& random);

double log_uniform(Random& random, double from, double to);

}  // namespace backlash::geared_arm
