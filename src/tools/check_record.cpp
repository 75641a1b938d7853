// SPDX-License-Identifier: BSD-3-Clause
// What a recording is, what is wrong with it and what it serves, before anything is estimated.
#include <filesystem>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_file/declared_motion.h"
#include "tools/common/command_line.h"
#include "tools/common/for_arm.h"
#include "tools/common/plot.h"
#include "tools/common/record_door.h"
#include "tools/common/record_file.h"
#include "tools/common/serves.h"

namespace backlash::tools {
namespace {

Command command() {
  Command c;
  c.name = "check_record";
  c.summary =
      "Says what a recording is, channel by channel, what is wrong with it and where, and which commands and "
      "methods it "
      "serves: the first thing to run on a recording of your own.";
  c.positional = {"RECORD.{csv,bag,mcap,db3,json,npz}"};
  c.options = {
      {"rig", "RIG.yaml", "rig file of the joint or arm: signs, units and methods are held against it"},
      {"json", "OUT.json", "report to write"},
      {"plot", "OUT.png", "also draw the channels as they were recorded, with what was found at its place"},
      {"joint", "NAME", "joint in a bag; default: the rig file's, else the only one"},
      {"topic", "NAME", "topic to read in a bag, alone or as the last part; default: joint_states"},
  };
  c.notes =
      "The other commands look at their records in the same way. What is noted is only said; what is mended "
      "is taken out "
      "(turns of a wrapped angle, single wild samples, repeated stamps); where something is cut they use "
      "what lies on "
      "one side; what is refused ends them with 65.";
  c.examples = {"check_record run.bag --rig rig.yaml --json check.json",
                "check_record run.csv --plot run.png"};
  c.exit_codes =
      "  0   the whole record can be used\n"
      "  1   only a part of it: something is cut\n"
      "  3   it cannot be used as it is\n";
  return c;
}

Looked look_at_joint(const Arguments& arguments) {
  const std::string& path = arguments.positional(0);
  std::optional<rig_file::RigFile> rig;
  BagPlace place;
  if (arguments.has("topic")) place.topic = arguments.text("topic");
  if (arguments.has("rig")) {
    rig = rig_file::load_rig_file(arguments.text("rig"));
    const std::string topic = place.topic;
    place = place_of(*rig);
    place.topic = topic;
  }
  if (arguments.has("joint")) {
    place.joint = arguments.text("joint");
    place.channels.declared = false;
  }
  record::Record as_read = read_record(path, place);
  std::vector<record::JointRecord> recorded;
  if (arguments.has("plot")) recorded.push_back({"", as_read});
  record::CheckedRecord checked = record::check_record(
      std::move(as_read), rig ? rig_file::declared_motion(rig->rig) : record::DeclaredMotion{});
  Looked looked{{path, {{"", checked.check}}}, {}, std::move(recorded), rig && rig->rig.linear};
  const record::Stretch longest = record::longest_stretch(checked.check);
  looked.serves = serves_of(looked.file, std::move(checked.record).slice(longest.from, longest.to), rig);
  return looked;
}

Looked look(const Arguments& arguments) {
  const std::string& path = arguments.positional(0);
  if (!arguments.has("rig") && !arguments.has("joint") && std::filesystem::path(path).extension() == ".csv") {
    std::vector<record::JointRecord> joints = record::read_joints_csv(path);
    if (joints.size() > 1)
      return look_at_joints(std::move(joints), path, std::nullopt, arguments.has("plot"));
  }
  return look_at_joint(arguments);
}

int check(const Arguments& arguments) {
  check_record_path(arguments.positional(0));
  std::vector<std::string> inputs = {arguments.positional(0)};
  if (arguments.has("rig")) inputs.push_back(arguments.text("rig"));
  if (arguments.has("json")) check_output(arguments.text("json"), inputs);
  if (arguments.has("plot")) {
    check_plot_path(arguments.text("plot"));
    if (arguments.has("json")) inputs.push_back(arguments.text("json"));
    check_output(arguments.text("plot"), inputs);
  }
  RecordDoor door("check_record");
  if (arguments.has("rig") && rig_file::is_arm_rig(arguments.text("rig")))
    return run_for_arm(arguments, door);
  return report_of(look(arguments), arguments);
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, check);
}
