// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iostream>

#include "backlash_diagnosis/arm_findings/arm_play_report.h"
#include "tools/arm/arm_commands.h"
#include "tools/arm/arm_record.h"
#include "tools/common/exit_codes.h"
#include "tools/common/record_file.h"

namespace backlash::tools {

int diagnose_arm(const Arguments& arguments, RecordDoor& door) {
  for (const char* option :
       {"report", "curve", "limits", "baseline", "save-baseline", "method", "joint", "topic", "periods"})
    if (arguments.has(option))
      throw UsageError(std::string("--") + option +
                       " is for a record of one joint; this is the rig file of an arm");
  const std::string out = arguments.text("json"), rig = arguments.text("rig");
  if (!out.empty() && out != kStandardOutput) check_output(out, {arguments.positional(0), rig});
  const geared_arm::GearedArm arm = geared_arm::load_geared_arm(rig);
  const arm::ArmRecord record = admitted_arm_record(arguments.positional(0), arm.rig, door);
  const arm_findings::ArmPlayReport report = arm_findings::arm_play_report(arm, record);
  const std::string json = door.with_findings(arm_findings::arm_play_json(report));
  if (out == kStandardOutput) {
    std::cout << json;
  } else {
    if (!out.empty()) write_text(out, json);
    arm_findings::print_arm_plays(report, std::cout);
  }
  // A fault that was found counts more than a joint without an answer.
  bool unknown = false;
  int worst = kHealthy;
  for (std::size_t j = 0; j < report.verdicts.size(); ++j) {
    // At most so much, without limits, is an answer.
    const bool small =
        report.plays[j].estimate.status == diagnosis::Status::below_range && !arm.joints[j].limits;
    const int code = small ? kHealthy : exit_code(report.verdicts[j].grade);
    if (code == kInconclusive)
      unknown = true;
    else
      worst = std::max(worst, code);
  }
  return worst == kHealthy && unknown ? kInconclusive : worst;
}

}  // namespace backlash::tools
