// SPDX-License-Identifier: BSD-3-Clause
// Says whether a joint has changed since it was commissioned, by which effect and since when.
#include <malloc.h>

#include <algorithm>
#include <filesystem>
#include <iostream>

#include "backlash_diagnosis/arm/arm_rig.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/changes/arm_changes.h"
#include "backlash_diagnosis/changes/change_report.h"
#include "backlash_diagnosis/changes/changes_of_rig.h"
#include "backlash_diagnosis/rig_file/declared_motion.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "tools/arm/arm_record.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_door.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

constexpr int kLargest = 1 << 25, kHeld = 1 << 30;  // bytes; the first is the most that may be asked for

Command command() {
  Command c;
  c.name = "detect_changes";
  c.summary =
      "Says whether a joint has changed since healthy records of it were made, by which effect, how much and "
      "since when.";
  c.positional = {"RECORD"};
  c.options = {
      {"rig", "RIG.yaml",
       "the machine as declared: one inertia (mesh: rigid), two, a torque sensor before the gear, or an arm "
       "(urdf)",
       true},
      {"healthy", "RECORD...", "records (.csv or .bag) of the healthy machine, better two tasks than one",
       true},
      {"json", "OUT.json", "changes with size, onset and intervals; default: the summary alone"},
      {"false-alarms-per-hour", "X",
       "how often a healthy machine may be called changed; default: 1/720, once a month"},
  };
  c.notes =
      "Records need motor_torque and motor_position, of two inertias also load_position where the backlash "
      "is asked; ordinary motion will do, but must be no faster than in the healthy records. Warm-up as in "
      "the healthy records, and slow drift of friction by up to 10 %, is no "
      "change. Sizes are what was added at the onset. A change that no effect explains is called unknown. Of "
      "a "
      "rig with a torque sensor (elastic input_coupling) they need motor_torque that reverses and "
      "sensor_torque, better motor_position too: the whole motion is fitted at some twenty places, which "
      "takes "
      "half a minute of a processor.";
  c.examples = {
      "detect_changes --rig config/ur10e_joint.yaml --healthy monday.csv tuesday.csv --json changes.json "
      "today.csv"};
  c.exit_codes =
      "  0   nothing has changed\n"
      "  2   something has\n"
      "  3   the records give no answer (too little motion, another gear train, something that no effect "
      "explains)\n";
  return c;
}

record::Record read(const std::string& path, const rig_file::RigFile& rig) {
  record::Record record = read_record(path, place_of(rig));
  record.name = std::filesystem::path(path).filename();
  return record;
}

/// A position that jumps needs no model to be seen: its zero moved, whatever else has changed.
changes::Change slip_of(const record::Jump& jump, const std::string& joint) {
  changes::Change change;
  change.effect = "encoder_slip";
  change.joint = joint;
  change.since = jump.after;
  change.since_from = jump.before;
  change.since_to = jump.after;
  change.size = {{"offset", "rad", jump.size}};
  change.gain = change.error_before = change.error_after = kNaN;
  return change;
}

void add_slips(changes::Changes& found, const std::vector<RecordDoor::JointJump>& jumps) {
  for (const RecordDoor::JointJump& jump : jumps) found.changes.push_back(slip_of(jump.jump, jump.joint));
  std::stable_sort(found.changes.begin(), found.changes.end(),
                   [](const changes::Change& a, const changes::Change& b) { return a.since < b.since; });
}

changes::Changes changes_of_joint(changes::ChangeInputs& inputs, const changes::ChangeSettings& settings,
                                  const Progress& progress, RecordDoor& door) {
  const rig_file::RigFile rig = rig_file::load_rig_file(inputs.rig);
  inputs.joint = rig.rig.joint;
  const record::DeclaredMotion declared = rig_file::declared_motion(rig.rig);
  std::vector<std::string> warnings;
  std::vector<record::Record> healthy;
  for (const std::string& file : inputs.healthy)
    healthy.push_back(door.admit_healthy(read(file, rig), declared, file));
  std::vector<RecordDoor::JointJump> jumps;
  const record::Record record =
      door.admit_with_jumps(read(inputs.record, rig), declared, inputs.record, jumps);
  for (const record::Record& each : healthy)
    for (const std::string& warning : each.warnings) warnings.push_back(each.name + ": " + warning);
  for (const std::string& warning : record.warnings) warnings.push_back(record.name + ": " + warning);
  changes::Changes found;
  try {
    found = changes::detect_changes(rig, healthy, record, settings, progress);
  } catch (const CannotIdentify& error) {
    if (jumps.empty()) throw;
    found.cannot_tell = error.what();
  }
  add_slips(found, jumps);
  found.warnings.insert(found.warnings.begin(), warnings.begin(), warnings.end());
  return found;
}

changes::Changes changes_of_arm(const changes::ChangeInputs& inputs, const changes::ChangeSettings& settings,
                                const Progress& progress, RecordDoor& door) {
  const arm::ArmRig rig = arm::load_arm_rig(inputs.rig);
  std::vector<std::string> warnings;
  std::vector<arm::ArmRecord> healthy;
  for (const std::string& file : inputs.healthy) healthy.push_back(admitted_arm_record(file, rig, door));
  std::vector<RecordDoor::JointJump> jumps;
  const arm::ArmRecord record =
      arm::arm_record(door.admit_with_jumps(read_joints(inputs.record, rig), inputs.record, jumps), rig,
                      std::filesystem::path(inputs.record).filename());
  for (const arm::ArmRecord& each : healthy)
    for (const std::string& warning : each.warnings) warnings.push_back(each.name + ": " + warning);
  for (const std::string& warning : record.warnings) warnings.push_back(record.name + ": " + warning);
  changes::Changes found = changes::detect_changes(rig, healthy, record, settings, progress);
  add_slips(found, jumps);
  found.warnings.insert(found.warnings.begin(), warnings.begin(), warnings.end());
  return found;
}

int detect(const Arguments& arguments) {
  changes::ChangeInputs inputs = {
      arguments.text("rig"), "", arguments.texts("healthy"), arguments.positional(0),
      arguments.number("false-alarms-per-hour", changes::ChangeSettings{}.false_alarms_per_hour,
                       Range::positive())};
  std::vector<std::string> files = inputs.healthy;
  files.push_back(inputs.record);
  for (const std::string& file : files) check_record_path(file);
  files.push_back(inputs.rig);
  if (arguments.has("json")) check_output(arguments.text("json"), files);
  changes::ChangeSettings settings;
  settings.false_alarms_per_hour = inputs.false_alarms_per_hour;
  changes::Changes found;
  RecordDoor door("detect_changes");
  try {
    ProgressBar bar;
    found = rig_file::is_arm_rig(inputs.rig) ? changes_of_arm(inputs, settings, bar.progress(), door)
                                             : changes_of_joint(inputs, settings, bar.progress(), door);
  } catch (const CannotIdentify& error) {
    found.cannot_tell = error.what();
    found.noise = kNaN;  // nothing was learned
  }
  if (arguments.has("json"))
    write_text(arguments.text("json"), door.with_findings(changes::change_json(found, inputs)));
  std::cout << changes::change_summary(found);
  if (!found.changes.empty()) return kFault;
  if (found.cannot_tell.empty()) return kHealthy;
  std::cerr << "detect_changes: " << found.cannot_tell << '\n';
  return kInconclusive;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  // Large arrays come and go by the hundred: giving each back to the system takes a third of the time.
  mallopt(M_MMAP_THRESHOLD, backlash::tools::kLargest);
  mallopt(M_TRIM_THRESHOLD, backlash::tools::kHeld);
  using namespace backlash::tools;
  return run_command(command(), argc, argv, detect);
}
