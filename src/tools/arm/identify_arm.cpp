// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <limits>

#include "backlash_diagnosis/arm/fit_records.h"
#include "backlash_diagnosis/arm_findings/arm_report.h"
#include "tools/arm/arm_commands.h"
#include "tools/arm/arm_record.h"
#include "tools/common/exit_codes.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_file.h"
#include "tools/common/weights.h"

namespace backlash::tools {

namespace {

std::vector<std::optional<arm::Carried>> carried_by(const Arguments& arguments) {
  std::vector<std::optional<arm::Carried>> all;
  for (const std::optional<Weight>& weight : weights_of(arguments)) {
    all.emplace_back();
    if (!weight) continue;
    if (weight->lever)
      throw UsageError(
          "--payload: a lever is that of a single joint; of an arm the records show where a body is");
    all.back() =
        arm::Carried{weight->mass.value_or(signal::Measured{0, std::numeric_limits<double>::quiet_NaN()})};
  }
  return all;
}

}  // namespace

int identify_arm(const Arguments& arguments, RecordDoor& door) {
  const std::vector<std::optional<arm::Carried>> carried = carried_by(arguments);
  const arm::ArmRig rig = arm::load_arm_rig(arguments.text("rig"));
  std::vector<arm::RecordMotions> records;
  std::vector<std::string> warnings;
  for (const std::string& path : arguments.positionals()) {
    const arm::ArmRecord record = admitted_arm_record(path, rig, door);
    for (const std::string& warning : record.warnings) warnings.push_back(record.name + ": " + warning);
    records.push_back(arm::motions_of(record, rig, warnings));
  }
  ProgressBar bar;
  arm::ArmFit fit = arm::fit_records(rig, records, {}, bar.progress(), carried);
  fit.warnings.insert(fit.warnings.end(), warnings.begin(), warnings.end());
  write_text(arguments.text("out"), arm_findings::fitted_arm_text(fit, arguments.positionals()));
  write_text(json_beside_out(arguments), door.with_findings(arm_findings::arm_identification_json(
                                             fit, arguments.text("rig"), arguments.positionals(), carried)));
  arm_findings::print_arm_summary(fit, arguments.positionals(), carried, std::cout);
  return fit.contradictions.empty() ? kHealthy : kInconclusive;
}

}  // namespace backlash::tools
