// SPDX-License-Identifier: BSD-3-Clause
// Plans a motion of an arm that shows the play of each joint and the parameters.
#include <algorithm>
#include <iostream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm_findings/motion_plan_report.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/geared_arm/motion_file.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/held_joints.h"
#include "tools/common/of_file.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

Command command() {
  Command c;
  c.name = "plan_motion";
  c.summary =
      "Plans a motion of all joints of an arm within their limits: each gap is crossed under known load, and "
      "links "
      "and drives are seen as well as they can be.";
  c.positional = {"RIG.yaml|ROBOT.urdf"};
  c.options = {
      {"out", "MOTION.yaml", "the motion: a Fourier series per joint, for simulate --motion", true},
      {"json", "OUT.json", "the same with all figures"},
      {"write-rig", "RIG.yaml", "of a URDF: the rig file that it is taken for, to complete and for identify"},
      hold_option(),
      {"csv", "TRAJECTORY.csv", "approach and one period as samples, for any controller; needs --rate"},
      {"rate", "HZ", "of --csv"},
      {"acceleration", "RAD/S^2", "limit of the joints whose motion_limits in the rig file have none"},
      {"period", "S", "of the motion; default: 20"},
      {"harmonics", "N", "of the series, 2 to 20; default: 10"},
      {"seed", "N", "of the search; default: 1. The same seed gives the same motion"},
  };
  c.notes =
      "Limits are the URDF's <limit>, tighter where motion_limits of a joint in the rig file says so. They "
      "are all "
      "that is known of the place: no walls, no collisions of the arm with itself. Watch the motion in a "
      "simulation of the cell, or slowly, before it is run. Of a URDF all joints that move are planned, from "
      "0 rad, but those that --hold names; its drives are unknown, so it is not reported how much of the "
      "load "
      "their friction hides.";
  c.examples = {
      "plan_motion config/two_link_arm/two_link_arm.yaml --out motion.yaml",
      "plan_motion robot.urdf --acceleration 5 --out motion.yaml --write-rig robot.yaml",
      "plan_motion robot_with_gripper.urdf --hold finger_joint=0.02 --acceleration 5 --out motion.yaml"};
  c.exit_codes =
      "  0   done\n  3   the gap of a joint cannot be shown within the limits; the motion for all others is "
      "written\n";
  return c;
}

geared_arm::PlanSettings settings_of(const Arguments& arguments) {
  geared_arm::PlanSettings s;
  s.period = arguments.number("period", s.period, Range::between(1, 1000));
  s.harmonics = int(arguments.integer("harmonics", std::uint64_t(s.harmonics), 2, 20));
  s.seed = arguments.integer("seed", s.seed, 0, std::numeric_limits<std::uint64_t>::max());
  return s;
}

void check_outputs(const Arguments& arguments, const std::vector<std::string>& inputs) {
  const std::string out = arguments.text("out");
  check_output(out, inputs);
  std::vector<std::string> others = {out};
  for (const char* option : {"json", "csv", "write-rig"}) {
    if (!arguments.has(option)) continue;
    const std::string path = arguments.text(option);
    check_output(path, inputs);
    if (std::find(others.begin(), others.end(), path) != others.end())
      throw UsageError(std::string("--") + option + " names the same file as another output");
    others.push_back(path);
  }
  if (arguments.has("csv") != arguments.has("rate")) throw UsageError("--csv and --rate go together");
}

geared_arm::GearedArm arm_of(const Arguments& arguments) {
  const std::string& path = arguments.positional(0);
  if (rig_file::is_urdf(path)) {
    const arm::ArmRig rig = arm::arm_rig_of_urdf(path, held_joints(arguments));
    check_outputs(arguments, {path});
    if (arguments.has("write-rig")) write_text(arguments.text("write-rig"), rig.text);
    return geared_arm::geared_arm_from_text(rig.text, "the rig of " + path, "");
  }
  for (const char* option : {"write-rig", "hold"})
    if (arguments.has(option))
      throw UsageError(std::string("--") + option + " is for a URDF; " + path + " is a rig file");
  if (!rig_file::is_arm_rig(path))
    throw BadData(
        path,
        "is the rig of one joint; a motion is planned for an arm (a rig file with urdf). A joint alone "
        "needs no plan: it is moved by the excitation of its rig file, see the test runs of identify and "
        "doc/howto/excite_a_joint.md");
  geared_arm::GearedArm arm = geared_arm::load_geared_arm(path);
  check_outputs(arguments, {path, arm.rig.urdf});
  return arm;
}

int plan(const Arguments& arguments) {
  const std::string& path = arguments.positional(0);
  const geared_arm::PlanSettings settings = settings_of(arguments);
  const double rate = arguments.number("rate", 0, Range::between(1, 1e5));
  std::optional<double> acceleration;
  if (arguments.has("acceleration")) acceleration = arguments.number("acceleration", 0, Range::positive());
  const geared_arm::GearedArm arm = arm_of(arguments);
  const std::vector<geared_arm::MotionLimits> limits = geared_arm::load_motion_limits(arm, acceleration);
  geared_arm::MotionPlan plan;
  {
    ProgressBar bar;
    plan = of_file(path, [&] { return geared_arm::plan_motion(arm, limits, settings, bar.progress()); });
  }
  write_text(arguments.text("out"), geared_arm::motion_text(plan));
  if (arguments.has("json")) write_text(arguments.text("json"), arm_findings::motion_plan_json(plan));
  if (arguments.has("csv")) write_text(arguments.text("csv"), geared_arm::trajectory_csv(arm, plan, rate));
  arm_findings::print_motion_plan(plan, std::cout);
  return plan.none_hidden() ? kHealthy : kInconclusive;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, plan);
}
