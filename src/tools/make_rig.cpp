// SPDX-License-Identifier: BSD-3-Clause
// From what a robot has, a recording and a URDF, to a rig file.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/rig_draft/draft.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/ros/joint_rigs.h"
#include "backlash_diagnosis/ros/live_robot.h"
#include "tools/arm/arm_record.h"
#include "tools/arm/bag_joints.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/held_joints.h"
#include "tools/common/record_door.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

namespace fs = std::filesystem;

Command command() {
  Command c;
  c.name = "make_rig";
  c.summary =
      "Writes a rig file from what a robot has: half a minute of its motion and its URDF. Beside each value "
      "stands "
      "where it came from and how well it is known.";
  c.options = {
      {"out", "RIG.yaml|FOLDER",
       "rig file to write; a folder that exists: one for each joint, as robot.launch takes them", true},
      {"bag", "RECORD", "recording of the joint or arm at work: .bag, .mcap, .db3, or .csv of this package"},
      {"topic", "TOPIC...",
       "or topics of sensor_msgs/JointState of a robot that runs; the recording is kept beside OUT as .bag"},
      {"duration", "S", "of --topic; default: 30"},
      {"urdf", "ROBOT.urdf", "the chain: inertia and weight behind a joint, limits"},
      {"robot-description", "",
       "or the parameter robot_description of a robot that runs, kept beside OUT as .urdf"},
      {"joint", "NAME", "only this joint, as a rig file of its own"},
      hold_option(),
      {"reduction-ratio", "N", "turns of the motor per turn of the joint: on the plate of motor or gear"},
      {"rotor-inertia", "KG_M2",
       "of the motor about its own shaft, by its data sheet; needs --reduction-ratio"},
      {"stiffness", "NM_PER_RAD", "of the gear, at the joint, by its data sheet"},
  };
  c.notes =
      "A joint with an encoder of its load as well, a URDF, or --rotor-inertia becomes two inertias with "
      "play between "
      "them; else one inertia. With a URDF of several joints, all of which the recording has, the file is "
      "that of the "
      "arm. What only a person can know is marked FILL IN, with a value to begin with; the file can be used "
      "as it is.";
  c.examples = {"make_rig --bag run.bag --out rig.yaml",
                "make_rig --bag run.bag --joint elbow_joint --urdf robot.urdf --out elbow.yaml",
                "make_rig --topic joint_states --robot-description --out arm.yaml"};
  c.exit_codes = "  0  done\n  3  the recording shows no inertia, and no URDF says one\n";
  return c;
}

/// The file beside OUT with another ending.
std::string beside(const std::string& out, const char* ending) {
  fs::path path(out);
  if (fs::is_directory(path)) return (path / ("robot" + std::string(ending))).string();
  return path.replace_extension(ending).string();
}

/// What is asked for, and where it is.
struct Inputs {
  std::string out, record, urdf;
  bool folder = false;
  arm::HeldJoints held;
  rig_draft::Given given;
};

void check_usage(const Arguments& a) {
  if (a.has("bag") && a.has("topic"))
    throw UsageError("--bag and --topic are two sources of one record: give one");
  if (a.has("urdf") && a.has("robot-description"))
    throw UsageError("--urdf and --robot-description are two sources of one chain: give one");
  if (!a.has("bag") && !a.has("topic") && !a.has("urdf") && !a.has("robot-description"))
    throw UsageError("nothing to make a rig file from: give --bag or --topic, and --urdf where there is one");
  if (a.has("rotor-inertia") && !a.has("reduction-ratio"))
    throw UsageError(
        "--rotor-inertia is of the motor's shaft: --reduction-ratio is needed to see it from the joint");
  if (a.has("duration") && !a.has("topic")) throw UsageError("--duration is of --topic");
  if (a.has("hold") && !a.has("urdf") && !a.has("robot-description"))
    throw UsageError("--hold is for joints of a URDF");
}

Inputs inputs_of(const Arguments& a) {
  check_usage(a);
  Inputs in;
  in.out = a.text("out");
  in.folder = fs::is_directory(in.out);
  in.held = held_joints(a);
  const auto given = [&](const char* option) -> std::optional<double> {
    if (!a.has(option)) return std::nullopt;
    return a.number(option, 0, Range::positive());
  };
  in.given = {given("reduction-ratio"), given("rotor-inertia"), given("stiffness")};
  in.record = a.has("bag") ? a.text("bag") : a.has("topic") ? beside(in.out, ".bag") : "";
  in.urdf = a.has("urdf") ? a.text("urdf") : a.has("robot-description") ? beside(in.out, ".urdf") : "";
  if (a.has("bag")) check_record_path(in.record);
  std::vector<std::string> read;
  if (a.has("bag")) read.push_back(in.record);
  if (a.has("urdf")) read.push_back(in.urdf);
  if (!in.folder) check_output(in.out, read);
  return in;
}

/// What comes from a robot that runs.
void take_from_robot(const Arguments& a, const Inputs& in) {
  if (a.has("robot-description")) write_text(in.urdf, ros_bridge::robot_description());
  if (!a.has("topic")) return;
  const double seconds = a.number("duration", 30, Range::between(5, 3600));
  std::cerr << fmt::format("make_rig: recording {:g} s on {} into {}\n", seconds, joined(a.texts("topic")),
                           in.record);
  ros_bridge::record_topics(a.texts("topic"), seconds, in.record);
}

struct SeenPlace {
  rig_draft::JointPlace place;
  record::Record record;
};

std::vector<SeenPlace> places_of(const std::string& path) {
  std::vector<SeenPlace> places;
  if (fs::path(path).extension() == ".csv") {
    for (record::JointRecord& joint : record::read_joints_csv(path))
      places.push_back(
          {{joint.joint.empty() ? kDefaultJoint : joint.joint, path, {}, false}, std::move(joint.record)});
    return places;
  }
  for (const FoundJoint& found : joints_of_bag(path)) {
    BagPlace place;
    place.joint = found.joint;
    place.channels = found.channels;
    places.push_back({{found.joint, path, found.channels, true}, read_record(path, place)});
  }
  return places;
}

void keep_only(std::vector<SeenPlace>& places, const std::string& joint, const std::string& path) {
  std::vector<std::string> there;
  for (const SeenPlace& p : places) there.push_back(printable(p.place.joint));
  places.erase(std::remove_if(places.begin(), places.end(),
                              [&](const SeenPlace& p) { return p.place.joint != joint; }),
               places.end());
  if (places.empty())
    throw BadData(path, "no joint '" + printable(joint) + "'; there are (--joint): " + joined(there));
}

/// The file is one that the other commands read.
void write_rig(const rig_draft::Draft& draft, const std::string& path) {
  rig_file::rig_file_from_text(draft.text, path);
  write_text(path, draft.text);
}

void say(const std::string& joint, const rig_draft::Draft& draft, const std::string& path) {
  std::cout << (joint.empty() ? "" : joint + ": ") << path << '\n';
  for (const std::string& note : draft.notes) std::cout << "  " << note << '\n';
  if (draft.to_fill.empty()) return;
  std::cout << "  to be filled in by a person (FILL IN):\n";
  for (const std::string& what : draft.to_fill) std::cout << "    " << what << '\n';
}

std::string quoted_path(const std::string& path) {
  return path.find(' ') == std::string::npos ? path : "'" + path + "'";
}

void say_next(const std::string& what) {
  std::cout << "next:\n  rosrun backlash_diagnosis " << what << '\n';
}

/// The chain behind a joint, the others in the middle of where they were.
std::optional<rig_draft::UrdfLoad> chain_behind(const Inputs& in, const std::string& joint,
                                                const std::map<std::string, double>& middles) {
  if (in.urdf.empty()) return std::nullopt;
  const std::vector<std::string> names = arm::moving_joints(in.urdf, in.held);
  const auto found = std::find(names.begin(), names.end(), joint);
  if (found == names.end())
    throw BadData(in.urdf, "no joint '" + printable(joint) + "' that moves; there are: " + joined(names) +
                               "; the recording's name must be that of the URDF");
  std::vector<double> pose;
  std::string words;
  for (const std::string& name : names) {
    const auto middle = middles.find(name);
    pose.push_back(middle == middles.end() ? 0 : middle->second);
    if (name != joint) words += fmt::format("{}{} {:.2f}", words.empty() ? "with " : ", ", name, pose.back());
  }
  rig_draft::UrdfLoad load = rig_draft::load_of_chain(arm::read_chain(in.urdf, names, in.held),
                                                      std::size_t(found - names.begin()), pose);
  load.file = fs::path(in.urdf).filename().string();
  load.pose = words.empty() ? "alone" : words + " rad";
  return load;
}

int make_joints(const Inputs& in, std::vector<SeenPlace> places) {
  if (places.size() > 1 && !in.folder) {
    std::vector<std::string> names;
    for (const SeenPlace& p : places) names.push_back(printable(p.place.joint));
    throw UsageError(in.record + " has several joints: name one with --joint (" + joined(names) +
                     "), give --urdf for the arm, or --out a folder that exists for a file of each");
  }
  RecordDoor door("make_rig");
  std::vector<rig_draft::SeenJoint> seen;
  std::map<std::string, double> middles;
  for (SeenPlace& p : places) {
    record::Record record = door.admit(std::move(p.record), {}, in.record);
    seen.push_back(rig_draft::look_at_joint({std::move(record), door.files().back().joints.front().check}));
    middles[p.place.joint] = seen.back().middle;
  }
  bool play = false;
  std::string path;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::string& joint = places[i].place.joint;
    const rig_draft::Draft draft =
        rig_draft::draft_joint(seen[i], places[i].place, chain_behind(in, joint, middles), in.given);
    path = in.folder ? ros_bridge::joint_path(in.out, joint, ".yaml") : in.out;
    write_rig(draft, path);
    say(joint, draft, path);
    play = play || draft.has_play;
  }
  if (in.folder)
    std::cout << "next:\n  roslaunch backlash_diagnosis robot.launch rig_folder:="
              << quoted_path(fs::absolute(in.out).lexically_normal().string()) << '\n';
  else if (play)
    say_next("diagnose_record " + quoted_path(in.record) + " --rig " + quoted_path(path) +
             " --json report.json");
  else
    say_next("identify " + quoted_path(in.record) + " --rig " + quoted_path(path) +
             " --out fitted.yaml --json fit.json");
  return kHealthy;
}

int make_arm(const Inputs& in, bool current) {
  arm::ArmRig rig = arm::arm_rig_of_urdf(in.urdf, in.held);
  if (current) rig.channel = record::Channel::motor_current;
  std::vector<record::JointRecord> records;
  if (!in.record.empty()) {
    RecordDoor door("make_rig");
    records = door.admit(read_joints(in.record, rig), in.record);
  }
  const rig_draft::Draft draft = rig_draft::draft_arm(rig, records, in.record);
  arm::arm_rig_from_text(draft.text, in.out, "");
  write_text(in.out, draft.text);
  say("", draft, in.out);
  const std::string record = in.record.empty() ? "RECORD" : quoted_path(in.record);
  say_next("identify " + record + " --rig " + quoted_path(in.out) + " --out fitted.yaml --json fit.json");
  std::cout << "  rosrun backlash_diagnosis diagnose_record " << record
            << " --rig fitted.yaml --json report.json\n";
  return kHealthy;
}

/// Whether the recording is one of all joints of the URDF. A joint that it lacks is an error where it has
/// others.
bool is_arm(const Inputs& in, const std::vector<SeenPlace>& places) {
  if (in.folder || in.urdf.empty() || places.size() < 2) return false;
  const std::vector<std::string> moving = arm::moving_joints(in.urdf, in.held);
  std::vector<std::string> absent;
  for (const std::string& name : moving)
    if (std::none_of(places.begin(), places.end(), [&](const SeenPlace& p) { return p.place.joint == name; }))
      absent.push_back(name);
  if (!absent.empty())
    throw BadData(in.record, "has no " + joined(absent) + " of " + in.urdf +
                                 ": name joints that stand still with --hold, or one joint with --joint");
  return true;
}

int make(const Arguments& arguments) {
  const Inputs in = inputs_of(arguments);
  take_from_robot(arguments, in);
  if (in.record.empty()) {
    if (in.folder || arguments.has("joint"))
      throw UsageError("a rig file of one joint needs a recording: --bag or --topic");
    return make_arm(in, false);
  }
  std::vector<SeenPlace> places = places_of(in.record);
  if (arguments.has("joint")) keep_only(places, arguments.text("joint"), in.record);
  if (is_arm(in, places)) {
    const record::Record& first = places.front().record;
    return make_arm(in,
                    !first.has(record::Channel::motor_torque) && first.has(record::Channel::motor_current));
  }
  return make_joints(in, std::move(places));
}

int make_or_say_why(const Arguments& arguments) {
  try {
    return make(arguments);
  } catch (const CannotIdentify& e) {
    std::cerr << "make_rig: " << e.what() << '\n';
    return kInconclusive;
  }
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, make_or_say_why);
}
