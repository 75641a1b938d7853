// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm_findings/motion_plan_report.h"

#include <fmt/format.h>

#include <ostream>

#include "backlash_diagnosis/base/version.h"
#include "report/json.h"

namespace backlash::arm_findings {
namespace {

report::Json gap_json(const geared_arm::JointPlan& joint) {
  if (!joint.gap) return nullptr;
  report::Json json = {{"status", geared_arm::to_string(joint.view)},
                       {"mesh_torque", {joint.least_load, joint.largest_load}},
                       {"certain", joint.certain},
                       {"stays", {joint.stays[0], joint.stays[1]}},
                       {"reach", {-joint.reach[0], joint.reach[1]}},
                       {"hidden", report::Json::array()},
                       {"message", joint.message}};
  for (const geared_arm::HiddenRange& range : joint.hidden)
    json["hidden"].push_back({{"from", range.lower}, {"to", range.upper}, {"flank", range.flank}});
  return json;
}

}  // namespace

std::string motion_plan_json(const geared_arm::MotionPlan& plan) {
  const auto& first = plan.joints.front().motion;
  report::Json json = {{"schema_version", 1},
                       {"version", version()},
                       {"rig", plan.rig},
                       {"seed", plan.settings.seed},
                       {"approach", first.approach},
                       {"period", first.period},
                       {"information",
                        {{"base_parameters", plan.base_parameters},
                         {"noise", plan.noise_known ? "declared" : "by_torque_limits"},
                         {"condition", report::json_number(plan.planned.condition)},
                         {"reference_condition", report::json_number(plan.reference.condition)},
                         {"gain", report::json_number(plan.gain)}}},
                       {"joints", report::Json::object()}};
  for (const geared_arm::JointPlan& joint : plan.joints)
    json["joints"][joint.joint] = {{"start", joint.motion.start},
                                   {"offset", joint.motion.offset},
                                   {"cosines", joint.motion.cosines},
                                   {"sines", joint.motion.sines},
                                   {"position", {joint.lower, joint.upper}},
                                   {"speed", joint.speed},
                                   {"acceleration", joint.acceleration},
                                   {"torque", joint.torque},
                                   {"gap", gap_json(joint)}};
  return report::dumped(json, 1);
}

void print_motion_plan(const geared_arm::MotionPlan& plan, std::ostream& out) {
  out << fmt::format(
      "{}: {} base parameters, condition {:.4g} (best of {} random motions: {:.4g}), standard errors {:.3g} "
      "times "
      "smaller than by that one\n",
      plan.rig, plan.base_parameters, plan.planned.condition, plan.settings.motions, plan.reference.condition,
      plan.gain);
  for (const geared_arm::JointPlan& joint : plan.joints)
    out << fmt::format("{}: {:.2f} to {:.2f} rad, at most {:.2f} rad/s, {:.2f} rad/s^2, {:.3g} N m\n  {}\n",
                       joint.joint, joint.lower, joint.upper, joint.speed, joint.acceleration, joint.torque,
                       joint.gap ? "gap " + joint.message : "no gap to show");
}

}  // namespace backlash::arm_findings
