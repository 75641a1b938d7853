// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <limits>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/geared_arm/motion_file.h"
#include "backlash_diagnosis/geared_arm/simulation.h"
#include "tools/arm/arm_commands.h"
#include "tools/common/exit_codes.h"
#include "tools/common/of_file.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_file.h"

namespace backlash::tools {

int simulate_arm(const Arguments& arguments) {
  for (const char* option : {"run", "list-runs", "backlash", "half-gap"})
    if (arguments.has(option))
      throw UsageError(std::string("--") + option +
                       " is for a rig of one joint; this is the rig file of an arm");
  for (const char* option : {"out", "duration"})
    if (!arguments.has(option)) throw UsageError(std::string("missing --") + option);
  const std::string out = arguments.text("out"), path = arguments.positional(0);
  check_written_path(out);
  geared_arm::GearedArm arm = geared_arm::load_geared_arm(path);
  arm.sensors.seed =
      arguments.integer("seed", arm.sensors.seed, 0, std::numeric_limits<std::uint64_t>::max());
  arm.sensors.sampling_rate = arguments.number("sample-rate", arm.sensors.sampling_rate, Range::positive());
  std::vector<std::string> inputs = {path, arm.rig.urdf};
  if (arguments.has("motion")) {
    inputs.push_back(arguments.text("motion"));
    geared_arm::follow(arm, geared_arm::read_motion(inputs.back()));
  }
  check_output(out, inputs);
  std::vector<record::JointRecord> joints;
  {
    ProgressBar bar;
    joints = of_file(path, [&] {
      return geared_arm::simulate_arm(arm, arguments.number("duration", 0, Range::positive()),
                                      bar.progress());
    });
  }
  write_joints(joints, out);
  std::cout << out << ": " << joints.front().record.size() << " samples at "
            << to_text(arm.sensors.sampling_rate) << " Hz of " << arm.rig.name << ", " << joints.size()
            << " joints\n";
  return kHealthy;
}

}  // namespace backlash::tools
