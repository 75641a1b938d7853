// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/findings/arm_play_report.h"

#include <fmt/format.h>

#include <cmath>
#include <ostream>

#include "backlash_diagnosis/base/version.h"
#include "report/diagnosis_data.h"

namespace backlash::findings {

ArmPlayReport arm_play_report(const geared_arm::GearedArm& arm, const arm::ArmRecord& record) {
  ArmPlayReport report;
  report.rig = arm.rig.name;
  report.record = record.name;
  report.warnings = record.warnings;
  report.joints = &record;
  std::vector<geared_arm::JointLoad> loads;
  for (const geared_arm::GearedJoint& joint : arm.joints)
    loads.push_back({joint.link_coulomb, joint.link_viscous});
  report.plays = geared_arm::plays_of(arm.rig, loads, record, report.warnings);
  for (std::size_t j = 0; j < report.plays.size(); ++j)
    report.verdicts.push_back(
        diagnosis::combine({report.plays[j].estimate}, arm.joints[j].limits, std::nullopt));
  return report;
}

std::string arm_play_json(const ArmPlayReport& report) {
  report::Json json = {{"schema_version", 1},         {"version", version()},
                       {"record", report.record},     {"rig", report.rig},
                       {"warnings", report.warnings}, {"joints", report::Json::object()}};
  for (std::size_t j = 0; j < report.plays.size(); ++j) {
    const geared_arm::JointPlay& play = report.plays[j];
    report::DiagnosisReport one;
    one.record = &report.joints->joints[j];
    one.rig = report.rig;
    one.diagnosis.estimates = {play.estimate};
    one.diagnosis.verdict = report.verdicts[j];
    report::Json joint = report::diagnosis_data(one);
    joint["record"] = report.record;
    joint["mesh_torque"] = report::json_interval(play.least_torque, play.largest_torque);
    joint["pose"] = report::json_interval(play.lower_position, play.upper_position);
    joint["fastest"] = report::json_number(play.fastest);
    joint["torque_disagreement"] = report::json_number(play.disagreement);
    joint["stays"] = {play.stays[0], play.stays[1]};
    joint["showing_pose"] = report::json_number(play.pose.value_or(std::nan("")));
    json["joints"][play.joint] = std::move(joint);
  }
  return report::dumped(json, 1);
}

void print_arm_plays(const ArmPlayReport& report, std::ostream& out) {
  for (std::size_t j = 0; j < report.plays.size(); ++j) {
    const geared_arm::JointPlay& play = report.plays[j];
    const diagnosis::Estimate& e = play.estimate;
    const bool small = e.status == diagnosis::Status::below_range;
    out << play.joint << ": " << (small ? "no play" : diagnosis::to_string(report.verdicts[j].grade));
    if (std::isfinite(e.backlash_angle))
      out << fmt::format(", play {:.4g} mrad [{:.4g}, {:.4g}]", 1e3 * e.backlash_angle, 1e3 * e.angle_lower,
                         1e3 * e.angle_upper);
    out << fmt::format(
        "\n  {}\n  pose {:.2f} to {:.2f} rad, up to {:.2f} rad/s, mesh torque {:.3g} to {:.3g} N m\n",
        e.message, play.lower_position, play.upper_position, play.fastest, play.least_torque,
        play.largest_torque);
  }
  for (const std::string& warning : report.warnings) out << "warning: " << warning << '\n';
}

}  // namespace backlash::findings
