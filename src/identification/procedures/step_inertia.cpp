// SPDX-License-Identifier: BSD-3-Clause
// Inertia of motor and drive from sine runs.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

constexpr double kLineModel =
    0.0005;  // theory: share of the motor in the inertia, not known better than to 40 %

}  // namespace

ProcedureReport run_line_inertia(IdentificationCase& c) {
  ProcedureReport report{"line_inertia", {}, ""};
  const model::Rig& rig = c.result.rig;
  std::string reasons;
  for (const bool alone : {true, false}) {
    InertiaDetail detail{alone ? "motor" : "drive", {}, {}};
    std::vector<signal::Measured> values;
    try {
      const auto used =
          on_each(c, alone ? &CaseRecord::motor_alone : &CaseRecord::drive, [&](const CaseRecord& r) {
            LineInertiaOptions options;
            options.torque_delay = 0.5 * r.record.sampling_interval();  // held where a loop commands it
            if (!alone) options.motor_share = rig.motor.inertia / (rig.motor.inertia + rig.link.inertia);
            detail.runs.push_back(line_inertia(r.record, options));
            values.push_back(detail.runs.back().inertia);
          });
      detail.combined = signal::robust_mean(values);
      std::map<std::string, double> sum = {{"motor_inertia", 1}};
      if (!alone) sum["load_inertia"] = 1;
      add_finding(c, "line_inertia", sum, with_model_error(detail.combined, kLineModel));
      report.records.insert(report.records.end(), used.begin(), used.end());
      report.message +=
          (report.message.empty() ? "" : "; ") + detail.subject + " " + plus_minus(detail.combined, "kg m^2");
      c.result.inertia.push_back(std::move(detail));
    } catch (const CannotIdentify& error) {
      reasons += std::string(reasons.empty() ? "" : "; ") + detail.subject + ": " + error.what();
    }
  }
  if (c.result.inertia.empty()) throw CannotIdentify(reasons);
  return report;
}

}  // namespace backlash::identification
