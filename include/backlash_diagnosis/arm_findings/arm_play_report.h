// SPDX-License-Identifier: BSD-3-Clause
// What diagnose_record reports of an arm: for each joint what it reports of one, with load, pose and motion.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/verdict.h"
#include "backlash_diagnosis/geared_arm/geared_arm.h"
#include "backlash_diagnosis/geared_arm/play.h"
#include "backlash_diagnosis/geared_arm/traverse.h"

namespace backlash::arm_findings {

struct ArmPlayReport {
  std::string rig, record;  // names
  std::vector<std::string> warnings;
  const arm::ArmRecord* joints = nullptr;
  std::vector<geared_arm::JointPlay> plays;
  std::vector<geared_arm::JointTraverse> traverses;  // of joints with one encoder; empty where none has
  std::vector<diagnosis::Verdict> verdicts;          // one per joint
};

/// Verdicts by the limits of each joint.
ArmPlayReport arm_play_report(const geared_arm::GearedArm& arm, const arm::ArmRecord& record);

std::string arm_play_json(const ArmPlayReport& report);
void print_arm_plays(const ArmPlayReport& report, std::ostream& out);

}  // namespace backlash::arm_findings
