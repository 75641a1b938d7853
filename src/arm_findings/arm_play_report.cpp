// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm_findings/arm_play_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "backlash_diagnosis/base/version.h"
#include "report/diagnosis_data.h"

namespace backlash::arm_findings {
namespace {

/// Of joints with one encoder. What the load shows of the flanks is said by whoever looked at it.
void add_traverses(ArmPlayReport& report, const geared_arm::GearedArm& arm, const arm::ArmRecord& record) {
  const auto alone = [](const record::Record& joint) { return !joint.has(record::Channel::load_position); };
  if (std::none_of(record.joints.begin(), record.joints.end(), alone)) return;
  std::vector<std::string> said;  // by plays_of() already
  report.traverses = geared_arm::traverses_of(arm, record, said);
  for (std::size_t j = 0; j < report.plays.size(); ++j) {
    if (!alone(record.joints[j])) report.traverses[j] = {};  // two encoders say it better
    diagnosis::Estimate& e = report.traverses[j].estimate;
    if (e.status == diagnosis::Status::out_of_domain && !report.traverses[j].turns &&
        !report.plays[j].one_flank.empty())
      e.message = report.plays[j].one_flank;
  }
}

std::vector<diagnosis::Estimate> estimates_of(const ArmPlayReport& report, std::size_t joint) {
  std::vector<diagnosis::Estimate> estimates{report.plays[joint].estimate};
  if (!report.traverses.empty() && !report.traverses[joint].estimate.method.empty())
    estimates.push_back(report.traverses[joint].estimate);
  return estimates;
}

}  // namespace

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
  add_traverses(report, arm, record);
  for (std::size_t j = 0; j < report.plays.size(); ++j)
    report.verdicts.push_back(
        diagnosis::combine(estimates_of(report, j), arm.joints[j].limits, std::nullopt));
  return report;
}

namespace {

report::Json crossings_json(const ArmPlayReport& report, std::size_t joint) {
  report::Json all = report::Json::array();
  for (const geared_arm::Crossing& c : report.traverses[joint].crossings) {
    report::Json pose = report::Json::object();
    for (std::size_t j = 0; j < c.pose.size(); ++j) pose[report.plays[j].joint] = c.pose[j];
    all.push_back({{"time", c.time},
                   {"duration", c.duration},
                   {"flank", c.flank},
                   {"speed", c.speed},
                   {"pose", std::move(pose)}});
  }
  return all;
}

/// Where and how fast the teeth changed flank, for people.
std::string crossings_text(const std::vector<geared_arm::Crossing>& all, std::size_t joint) {
  if (all.empty()) return {};
  const auto [low, high] = std::minmax_element(
      all.begin(), all.end(), [&](const auto& a, const auto& b) { return a.pose[joint] < b.pose[joint]; });
  const auto [slow, fast] = std::minmax_element(
      all.begin(), all.end(), [](const auto& a, const auto& b) { return a.speed < b.speed; });
  return fmt::format("  crossings at {:.2f} to {:.2f} rad, {:.2f} to {:.2f} rad/s\n", low->pose[joint],
                     high->pose[joint], slow->speed, fast->speed);
}

}  // namespace

std::string arm_play_json(const ArmPlayReport& report) {
  report::Json json = {{"schema_version", 1},         {"version", version()},
                       {"record", report.record},     {"rig", report.rig},
                       {"warnings", report.warnings}, {"joints", report::Json::object()}};
  for (std::size_t j = 0; j < report.plays.size(); ++j) {
    const geared_arm::JointPlay& play = report.plays[j];
    report::DiagnosisReport one;
    one.record = &report.joints->joints[j];
    one.rig = report.rig;
    one.diagnosis.estimates = estimates_of(report, j);
    one.diagnosis.verdict = report.verdicts[j];
    report::Json joint = report::diagnosis_data(one);
    joint["record"] = report.record;
    joint["mesh_torque"] = report::json_interval(play.least_torque, play.largest_torque);
    joint["pose"] = report::json_interval(play.lower_position, play.upper_position);
    joint["fastest"] = report::json_number(play.fastest);
    joint["torque_disagreement"] = report::json_number(play.disagreement);
    joint["stays"] = {play.stays[0], play.stays[1]};
    joint["showing_pose"] = report::json_number(play.pose.value_or(std::nan("")));
    if (one.diagnosis.estimates.size() > 1) joint["crossings"] = crossings_json(report, j);
    json["joints"][play.joint] = std::move(joint);
  }
  return report::dumped(json, 1);
}

void print_arm_plays(const ArmPlayReport& report, std::ostream& out) {
  for (std::size_t j = 0; j < report.plays.size(); ++j) {
    const geared_arm::JointPlay& play = report.plays[j];
    const diagnosis::Estimate e = estimates_of(report, j).back();
    const bool small = e.status == diagnosis::Status::below_range;
    out << play.joint << ": " << (small ? "no play" : diagnosis::to_string(report.verdicts[j].grade));
    if (std::isfinite(e.backlash_angle))
      out << fmt::format(", play {:.4g} mrad [{:.4g}, {:.4g}]", 1e3 * e.backlash_angle, 1e3 * e.angle_lower,
                         1e3 * e.angle_upper);
    out << fmt::format(
        "\n  {}\n  pose {:.2f} to {:.2f} rad, up to {:.2f} rad/s, mesh torque {:.3g} to {:.3g} N m\n",
        e.message, play.lower_position, play.upper_position, play.fastest, play.least_torque,
        play.largest_torque);
    if (!report.traverses.empty()) out << crossings_text(report.traverses[j].crossings, j);
  }
  for (const std::string& warning : report.warnings) out << "warning: " << warning << '\n';
}

}  // namespace backlash::arm_findings
