// SPDX-License-Identifier: BSD-3-Clause
// CSV to bag or recording of ROS 2 and back.
#include <fmt/format.h>

#include <cmath>
#include <iostream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/numbers.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/for_arm.h"
#include "tools/common/record_door.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

Command command() {
  Command c;
  c.name = "convert_record";
  c.summary =
      "Converts a record between CSV, bag and MCAP (sensor_msgs/JointState on /joint_states) and reads "
      "recordings of ROS 2 (MCAP, rosbag2's SQLite file or its folder) and what `channels` of a rig file "
      "describe (CSV, JSON, .npz); times and values survive the way "
      "there and back.";
  c.positional = {"IN.{csv,bag,mcap,db3,json,npz}", "OUT.{csv,bag,mcap}"};
  c.options = {
      {"rig", "RIG.yaml", "rig file of the joint or arm: its names, and which columns are its channels"},
      {"joint", "NAME",
       "joint in the bag, its names are NAME_motor, NAME_sensor, NAME_load, NAME_current and "
       "NAME_accelerometer; default: the rig's, "
       "else the only one (reading) or 'joint' (writing)"},
      {"topic", "NAME", "topic to read in a bag, alone or as the last part; default: joint_states"},
      {"from", "S", "only what is recorded from this time on, of the record's own [s]"},
      {"to", "S", "only what is recorded before this time [s]"},
  };
  c.notes =
      "Only header stamps count. Time 0 of a CSV becomes the stamp 1000000000 s, as ROS refuses 0; the topic "
      "/record_info in the bag says so. A recorded bag without it begins at time 0.";
  c.examples = {"convert_record run.csv run.bag --joint elbow", "convert_record run.bag run.csv",
                "convert_record rosbag2_run/ run.mcap --joint elbow",
                "convert_record run.csv first_half.csv --to 10"};
  c.exit_codes = "  0   done\n";
  return c;
}

/// What --from and --to leave of it.
record::Record part_of(record::Record record, const Arguments& arguments, const std::string& name) {
  if (!arguments.has("from") && !arguments.has("to")) return record;
  const Range any = Range::any();
  const double from = arguments.number("from", -HUGE_VAL, any), to = arguments.number("to", HUGE_VAL, any);
  if (!(from < to)) throw UsageError("--from must be before --to");
  const double first = record.time.front(), last = record.time.back();
  record = std::move(record).slice(from, to);
  if (record.size() == 0)
    throw BadData(
        name, fmt::format("has no sample from {:.6g} s on before {:.6g} s; it lasts from {:.6g} to {:.6g} s",
                          from, to, first, last));
  return record;
}

int convert(const Arguments& arguments) {
  const std::string &in = arguments.positional(0), &out = arguments.positional(1);
  check_record_path(in);
  check_written_path(out);
  if (arguments.has("rig") && rig_file::is_arm_rig(arguments.text("rig"))) {
    RecordDoor door("convert_record");
    return run_for_arm(arguments, door);
  }
  BagPlace place;
  if (arguments.has("rig")) place = place_of(rig_file::load_rig_file(arguments.text("rig")));
  if (arguments.has("joint") || arguments.has("topic")) place.channels.declared = false;
  if (arguments.has("joint")) place.joint = arguments.text("joint");
  if (arguments.has("topic")) place.topic = arguments.text("topic");
  std::vector<std::string> inputs = {in};
  if (arguments.has("rig")) inputs.push_back(arguments.text("rig"));
  record::Record record = part_of(read_record(in, place), arguments, in);
  record::keep_rows_with_numbers({&record});
  check_output(out, inputs);
  for (const std::string& warning : record.warnings)
    std::cerr << "convert_record: " << in << ": " << warning << '\n';
  write_record(record, out, place.joint.empty() ? kDefaultJoint : place.joint);
  std::cout << out << ": " << record.size() << " samples\n";
  return kHealthy;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, convert);
}
