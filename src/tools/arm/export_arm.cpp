// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>

#include "backlash_diagnosis/arm_findings/identified_urdf.h"
#include "tools/arm/arm_commands.h"
#include "tools/common/exit_codes.h"
#include "tools/common/record_file.h"

namespace backlash::tools {

int export_arm(const Arguments& arguments) {
  const std::string rig = arguments.text("rig"), urdf = arguments.text("urdf"), out = arguments.text("out");
  const geared_arm::GearedArm arm = geared_arm::load_geared_arm(rig);
  const arm_findings::IdentifiedUrdf model = arm_findings::identified_urdf(arm::read_urdf(urdf), urdf, arm);
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
