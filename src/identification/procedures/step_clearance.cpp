// SPDX-License-Identifier: BSD-3-Clause
// Backlash from a load that is rocked while the motor is braked.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

constexpr double kClearanceModel = 0.005;  // simulation: a push that is no polynomial, steps of the sensor

}  // namespace

ProcedureReport run_clearance(IdentificationCase& c) {
  ProcedureReport report{"clearance", {}, ""};
  const ClearanceSettings settings = clearance_settings(
      rig_file::servo_parameter("mesh_stiffness").get(c.result.rig), c.result.rig.link.inertia);
  std::string reasons;
  for (const CaseRecord& r : c.records) {
    if (r.motor_moves || !r.load_moves) continue;
    try {
      const Clearance found = identify_clearance(r.record, settings);
      add_finding(c, report.name, {{"backlash_angle", 1}}, with_model_error(found.gap, kClearanceModel));
      report.records.push_back(r.record.name);
      report.message =
          plus_minus(found.gap, "rad") + " from " + std::to_string(found.passages.size()) + " passages";
      c.result.clearance = found;
    } catch (const CannotIdentify& error) {
      reasons += std::string(reasons.empty() ? "" : "; ") + error.what();
    }
  }
  if (report.records.empty())
    throw CannotIdentify(reasons.empty() ? "no record with the motor braked" : reasons);
  return report;
}

}  // namespace backlash::identification
