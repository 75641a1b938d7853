// SPDX-License-Identifier: BSD-3-Clause
// A geared joint as a model of another simulator.
#include <filesystem>
#include <iostream>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/report/simulator_model.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/for_arm.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

Command command() {
  Command c;
  c.name = "export_model";
  c.summary =
      "Writes the joint of a rig file as a model of other simulators: MJCF of MuJoCo, URDF or SDF; or what "
      "was "
      "identified of an arm into the URDF or MJCF of its robot. What these languages cannot say, and what "
      "keeps "
      "its value, is named on standard error.";
  c.positional = {"[RIG.yaml]"};
  c.options = {
      {"urdf", "ROBOT.urdf",
       "in place of RIG.yaml: a robot's own file, in which what was identified of it is written: mass, "
       "centre and "
       "inertia of its links, friction and play of its joints; all else stays as it is"},
      {"mjcf", "ROBOT.xml",
       "the same of a robot's own MuJoCo file: inertial of its bodies, damping, frictionloss and armature of "
       "its joints"},
      {"rig", "FITTED.yaml", "with --urdf or --mjcf: the rig file of that robot as identify has fitted it"},
      {"out", "JOINT.{xml,mjcf,urdf,sdf}", "model to write, in the language of its extension; xml is MJCF",
       true},
      {"torque", "T",
       "torque at the load side [N m] at which a contact law that is no spring and damper is taken for one; "
       "needed for such a law only"},
  };
  c.notes =
      "One inertia, or two with a gap between them. All values are those at the load side of the reduction.";
  c.examples = {"export_model config/two_inertia_servo.yaml --out servo.xml",
                "export_model fitted.yaml --out joint.sdf",
                "export_model --urdf robot.urdf --rig fitted.yaml --out identified.urdf",
                "export_model --mjcf robot.xml --rig fitted.yaml --out identified.xml"};
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

int export_robot(const Arguments& arguments) {
  const bool urdf = arguments.has("urdf");
  if (urdf && arguments.has("mjcf")) throw UsageError("--urdf and --mjcf: one file at a time");
  const std::string kind = urdf ? "urdf" : "mjcf", robot = arguments.text(kind), out = arguments.text("out");
  if (!arguments.positionals().empty() || !arguments.has("rig"))
    throw UsageError("--" + kind + " needs --rig FITTED.yaml, and no RIG.yaml beside it");
  const std::string rig = arguments.text("rig");
  if (format_of(out) != (urdf ? report::SimulatorFormat::urdf : report::SimulatorFormat::mjcf))
    throw UsageError(urdf ? "--out: a robot's URDF becomes a URDF" : "--out: a robot's MJCF becomes an MJCF");
  check_output(out, {rig, robot});
  if (!rig_file::is_arm_rig(rig)) throw BadData(rig, "is no rig file of an arm (urdf)");
  RecordDoor door("export_model");
  return run_for_arm(arguments, door);
}

int export_model(const Arguments& arguments) {
  if (arguments.has("urdf") || arguments.has("mjcf")) return export_robot(arguments);
  if (arguments.positionals().empty()) throw UsageError("missing RIG.yaml");
  if (arguments.has("rig")) throw UsageError("--rig belongs to --urdf or --mjcf");
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
