// SPDX-License-Identifier: BSD-3-Clause
// Friction lines of motor and drive; the difference is the load.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

/// Friction of one direction: the mean, and half the difference with its sign.
void add_directional(std::map<std::string, double>& combination, const rig_file::RigParameter& mean,
                     double sign) {
  combination[mean.name] = 1;
  if (const rig_file::RigParameter* asymmetry = rig_file::asymmetry_of(mean))
    combination[asymmetry->name] = sign;
}

/// Both directions of one subject, and what they say about the bodies in `bodies`.
void add_friction(IdentificationCase& c, const std::string& subject,
                  const std::vector<ConstantSpeedRun>& runs, const std::vector<rig_file::RigPart>& bodies) {
  FrictionDetail detail{subject, {}};
  for (const Direction direction : {Direction::positive, Direction::negative}) {
    const double sign = direction == Direction::positive ? 1 : -1;
    try {
      const FrictionLine line = fit_friction_line(runs, direction);
      std::map<std::string, double> coulomb, viscous;
      for (const rig_file::RigPart body : bodies) {
        add_directional(coulomb, rig_file::servo_parameter(body, rig_file::ParameterKind::coulomb_friction),
                        sign);
        add_directional(viscous, rig_file::servo_parameter(body, rig_file::ParameterKind::viscous_friction),
                        sign);
      }
      add_finding(c, "friction_lines", coulomb, {sign * line.coulomb.value, line.coulomb.standard_error});
      add_finding(c, "friction_lines", viscous, line.viscous);
      for (const std::string& warning : line.warnings)
        c.result.warnings.push_back("friction of the " + subject +
                                    (sign > 0 ? ", forward: " : ", backward: ") + warning);
      detail.lines.push_back(line);
    } catch (const CannotIdentify& error) {
      c.result.warnings.push_back("friction of the " + subject + (sign > 0 ? ", forward: " : ", backward: ") +
                                  error.what());
    }
  }
  if (!detail.lines.empty()) c.result.friction.push_back(std::move(detail));
}

}  // namespace

ProcedureReport run_friction_lines(IdentificationCase& c) {
  ProcedureReport report{"friction_lines", {}, ""};
  struct Subject {
    const char* name;
    bool (CaseRecord::*wanted)() const;
    std::vector<rig_file::RigPart> bodies;
  };
  for (const Subject& s :
       {Subject{"motor", &CaseRecord::motor_alone, {rig_file::RigPart::motor}},
        Subject{"drive", &CaseRecord::drive, {rig_file::RigPart::motor, rig_file::RigPart::link}}}) {
    std::vector<ConstantSpeedRun> runs;
    try {
      const auto used = on_each(c, s.wanted, [&](const CaseRecord& r) {
        const auto more = find_constant_speed(r.record);
        runs.insert(runs.end(), more.begin(), more.end());
      });
      add_friction(c, s.name, runs, s.bodies);
      report.records.insert(report.records.end(), used.begin(), used.end());
    } catch (const CannotIdentify& error) {
      report.message += std::string(report.message.empty() ? "" : "; ") + s.name + ": " + error.what();
    }
  }
  if (c.result.friction.empty()) throw CannotIdentify(report.message);
  for (const FrictionDetail& d : c.result.friction)
    for (const FrictionLine& line : d.lines)
      report.message += (report.message.empty() ? "" : "; ") + d.subject + " " +
                        plus_minus(line.coulomb, "N m") + ", " + plus_minus(line.viscous, "N m s/rad");
  return report;
}

}  // namespace backlash::identification
