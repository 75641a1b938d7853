// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>

#include "backlash_diagnosis/arm_findings/identified_model.h"
#include "tools/arm/arm_commands.h"
#include "tools/common/exit_codes.h"
#include "tools/common/record_file.h"

namespace backlash::tools {

int export_arm(const Arguments& arguments) {
  const bool urdf = arguments.has("urdf");
  const std::string rig = arguments.text("rig"), robot = arguments.text(urdf ? "urdf" : "mjcf"),
                    out = arguments.text("out");
  const geared_arm::GearedArm arm = geared_arm::load_geared_arm(rig);
  const std::string text = arm::read_urdf(robot);
  const arm_findings::IdentifiedModel model = urdf ? arm_findings::identified_urdf(text, robot, arm)
                                                   : arm_findings::identified_mjcf(text, robot, arm);
  write_text(out, model.text);
  for (const std::string& what : model.kept)
    std::cerr << "export_model: kept as in the file: " << what << '\n';
  for (const std::string& what : model.unsaid)
    std::cerr << "export_model: " << out << " does not say: " << what << '\n';
  for (const std::string& what : model.written) std::cout << what << '\n';
  std::cout << out << ": " << arm.rig.name << '\n';
  return kHealthy;
}

}  // namespace backlash::tools
