// SPDX-License-Identifier: BSD-3-Clause
// Identifies the machine of a rig file from records of it and writes the fitted rig file.
#include "backlash_diagnosis/identification/identify.h"

#include <filesystem>
#include <iostream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/findings/identification_report.h"
#include "backlash_diagnosis/identification/fitted_rig.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/rig_file/declared_motion.h"
#include "backlash_diagnosis/rig_file/rig_document.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/for_arm.h"
#include "tools/common/of_file.h"
#include "tools/common/plot.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_door.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

Command command() {
  Command c;
  c.name = "identify";
  c.summary =
      "Finds the parameters of a machine from records of it: chooses the procedures that the records allow, "
      "fits all parameters "
      "together, writes the rig file with the fitted values.";
  c.positional = {"RECORD..."};
  c.options = {
      {"rig", "RIG.yaml", "the machine as declared: structure, and values to start from (within some 40 %)",
       true},
      {"out", "FITTED.yaml", "the rig file with the fitted values, each with its standard error", true},
      {"json", "OUT.json",
       "procedures, parameters with standard errors, errors per channel, warnings; "
       "default: FITTED.json beside --out"},
      {"plot", "OUT.png", "also draw what the procedures saw"},
      {"payload", "[RECORD=]WEIGHT",
       "what the machine carries in the first RECORD, or in that one: \"2.805 kg +- 0.005\" (one standard "
       "error), of a single joint \"1 kg at 0.15 m\", or unknown; may be there several times. Records "
       "without "
       "it carry nothing. A known weight measures the torque constants",
       false, true},
  };
  c.notes =
      "A rig with two inertias (rigid couplings, free link) is identified from motor_torque, motor_position "
      "and load_position; one "
      "inertia (mesh: rigid) and a locked output (link: locked) from motor_torque and motor_position. More "
      "runs identify more: constant speeds both "
      "ways (friction, gap "
      "over position), sine about a speed (inertia), sweep with bias (frequency response), square wave "
      "(damping), load moved by "
      "hand with the motor braked (clearance), the driver alone. A gear train with a torque sensor is "
      "fitted about the reversals of the torque, to sensor_torque and motor_position as far as they are "
      "there; "
      "its records may be of several states of wear, the first of the one that the file declares. "
      "An arm (a rig file with urdf) is fitted to records of all its joints, columns JOINT/channel: "
      "links, drives and torque constants together. "
      "All parameters are those of the load side "
      "of the reduction.";
  c.examples = {"identify run.csv --rig config/two_inertia_servo.yaml --out fitted.yaml --json fit.json",
                "identify runs/*.csv --rig config/yumrukcal_2013.yaml --out fitted.yaml --json fit.json "
                "--plot fit.png"};
  c.exit_codes =
      "  0   done\n"
      "  3   the records allow no procedure, contradict each other (then the values hold none of them well, "
      "and their errors hold all), or are of a machine of another kind: half of what a channel does, and "
      "more, is left (then errors are null and FITTED.yaml keeps what was declared); OUT.json has the "
      "reason\n";
  return c;
}

void check_outputs(const Arguments& arguments) {
  std::vector<std::string> inputs = arguments.positionals();
  inputs.push_back(arguments.text("rig"));
  const std::string json = json_beside_out(arguments), out = arguments.text("out"),
                    plot = arguments.text("plot");
  if (json == out) throw UsageError("--json and --out name the same file");
  check_output(json, inputs);
  check_output(out, inputs);
  if (plot.empty()) return;
  check_plot_path(plot);
  check_output(plot, inputs);
}

int identify_joint(const Arguments& arguments, RecordDoor& door) {
  const rig_file::RigFile file = rig_file::load_rig_file(arguments.text("rig"));
  if (!file.diagnosis.waveform) rig_file::RigDocument(file).check_changes(file.rig);  // before the work
  record::DeclaredMotion declared = rig_file::declared_motion(file.rig);
  declared.may_hold_load = arguments.positionals().size() > 1;
  std::vector<record::Record> records;
  for (const std::string& path : arguments.positionals()) {
    record::Record record = read_record(path, place_of(file));
    record.name = std::filesystem::path(path).filename();
    for (record::Record& stretch : door.admit_stretches(std::move(record), declared, path))
      for (record::Record& part : record::parts_between_gaps(std::move(stretch)))
        records.push_back(std::move(part));
  }
  identification::Identification found = of_file(file.source, [&] {
    ProgressBar bar;  // gone before anything is printed
    return file.diagnosis.waveform ? identification::commission(file, records)
                                   : identification::identify(file.rig, records, bar.progress());
  });
  for (const record::Record& record : records)
    for (const std::string& warning : record.warnings) found.warnings.push_back(record.name + ": " + warning);
  write_text(arguments.text("out"), identification::fitted_rig_text(file, found));
  write_text(json_beside_out(arguments), door.with_findings(findings::identification_json(
                                             found, arguments.text("rig"), arguments.positionals())));
  findings::print_summary(found, std::cout);
  std::cout.flush();
  if (arguments.has("plot")) plot_identification(json_beside_out(arguments), arguments.text("plot"));
  return found.several || found.unexplained ? kInconclusive : kHealthy;
}

int identify_machine(const Arguments& arguments) {
  for (const std::string& path : arguments.positionals()) check_record_path(path);
  check_outputs(arguments);
  const bool is_arm = rig_file::is_arm_rig(arguments.text("rig"));
  if ((is_arm || arguments.has("payload")) && arguments.has("plot"))
    throw UsageError("--plot: there is no plot for an arm, nor of a known weight");
  RecordDoor door("identify");
  try {
    return is_arm || arguments.has("payload") ? run_for_arm(arguments, door)
                                              : identify_joint(arguments, door);
  } catch (const CannotIdentify& error) {
    std::cerr << "identify: " << error.what() << '\n';
    identification::Identification nothing;
    nothing.warnings.emplace_back(error.what());
    write_text(json_beside_out(arguments), door.with_findings(findings::identification_json(
                                               nothing, arguments.text("rig"), arguments.positionals())));
    return kInconclusive;
  }
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, identify_machine);
}
