// SPDX-License-Identifier: BSD-3-Clause
// A geared joint as a model of another simulator.
#include <filesystem>
#include <iostream>
#include <optional>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/report/simulator_model.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

Command command() {
  Command c;
  c.name = "export_model";
  c.summary =
      "Writes the joint of a rig file as a model of other simulators: MJCF of MuJoCo, URDF or SDF. What "
      "these "
      "languages cannot say is named on standard error and in the file.";
  c.positional = {"RIG.yaml"};
  c.options = {
      {"out", "JOINT.{xml,mjcf,urdf,sdf}", "model to write, in the language of its extension; xml is MJCF",
       true},
      {"torque", "T",
       "torque at the load side [N m] at which a contact law that is no spring and damper is taken for one; "
       "needed for such a law only"},
  };
  c.notes =
      "One inertia, or two with a gap between them. All values are those at the load side of the reduction.";
  c.examples = {"export_model config/two_inertia_servo.yaml --out servo.xml",
                "export_model fitted.yaml --out joint.sdf"};
  c.exit_codes = "  0   done\n";
  return c;
}

report::SimulatorFormat format_of(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension();
  if (extension == ".xml" || extension == ".mjcf") return report::SimulatorFormat::mjcf;
  if (extension == ".urdf") return report::SimulatorFormat::urdf;
  if (extension == ".sdf") return report::SimulatorFormat::sdf;
  throw UsageError("'" + printable(path, 4096) + "': a model must end in .xml, .mjcf, .urdf or .sdf");
}

int export_model(const Arguments& arguments) {
  const std::string &rig = arguments.positional(0), out = arguments.text("out");
  const report::SimulatorFormat format = format_of(out);
  check_output(out, {rig});
  std::optional<double> torque;
  if (arguments.has("torque")) torque = arguments.number("torque", 0, Range::positive());
  const rig_file::RigFile file = rig_file::load_rig_file(rig);
  const report::SimulatorModel model = report::simulator_model(file, format, torque);
  write_text(out, model.text);
  for (const std::string& what : model.unsaid)
    std::cerr << "export_model: " << out << " does not say: " << what << '\n';
  std::cout << out << ": " << file.rig.name << '\n';
  return kHealthy;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, export_model);
}
