// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/record_file.h"

#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/record/table_file.h"
#include "backlash_diagnosis/recording/recording.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "tools/common/command_line.h"

namespace backlash::tools {
namespace {

namespace fs = std::filesystem;

bool ends_in(const std::string& path, const char* extension) {
  return fs::path(path).extension() == extension;
}

/// Puts off Ctrl-C and its like while a file is written.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
    pthread_sigmask(SIG_BLOCK, &signals, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_;
};

}  // namespace

const std::string kDefaultJoint = "joint";

void check_record_path(const std::string& path) {
  const std::string name = printable(path, 4096);
  if (ends_in(path, ".parquet"))
    throw UsageError(
        "'" + name +
        "': Parquet is not read; as a CSV it is: python3 -c \"import pandas; pandas.read_parquet('" + name +
        "').to_csv('" + printable(fs::path(path).replace_extension(".csv").string(), 4096) +
        "', index=False)\"");
  if (!ends_in(path, ".csv") && !ends_in(path, ".bag") && !record::is_table_file(path) &&
      !recording::is_recording(path))
    throw UsageError(
        "'" + name +
        "': a record must end in .csv, .bag, .mcap, .db3, .json or .npz or be a folder of rosbag2");
}

void check_written_path(const std::string& path) {
  if (!ends_in(path, ".csv") && !ends_in(path, ".bag") && !ends_in(path, ".mcap"))
    throw UsageError("'" + printable(path, 4096) + "': a record is written as .csv, .bag or .mcap");
}

BagPlace place_of(const rig_file::RigFile& file) {
  BagPlace place;
  place.joint = file.rig.joint;
  place.channels = file.channels;
  return place;
}

record::Record read_record(const std::string& path, const BagPlace& place) {
  check_record_path(path);
  if (ends_in(path, ".csv")) return record::read_csv(path, place.channels, place.joint);
  if (record::is_table_file(path)) return record::read_table(path, place.channels);
  return place.channels.declared ? ros_bridge::read_bag(path, place.channels)
                                 : ros_bridge::read_bag(path, place.joint, place.topic);
}

void write_record(const record::Record& record, const std::string& path, const std::string& joint) {
  check_written_path(path);
  const SignalsBlocked blocked;
  if (ends_in(path, ".bag"))
    ros_bridge::write_bag(record, path, joint);
  else if (ends_in(path, ".mcap"))
    ros_bridge::write_mcap(record, path, joint);
  else
    record::write_csv(record, path);
}

void write_joints(const std::vector<record::JointRecord>& joints, const std::string& path) {
  check_written_path(path);
  const SignalsBlocked blocked;
  if (ends_in(path, ".bag"))
    ros_bridge::write_bag(joints, path);
  else if (ends_in(path, ".mcap"))
    ros_bridge::write_mcap(joints, path);
  else
    record::write_joints_csv(joints, path);
}

void write_text(const std::string& path, const std::string& text) {
  const SignalsBlocked blocked;
  write_file(path, text);
}

void check_output(const std::string& path, const std::vector<std::string>& inputs) {
  std::error_code error;
  for (const std::string& input : inputs)
    if (fs::equivalent(path, input, error))
      throw UsageError("'" + printable(path, 4096) + "' would overwrite the input '" +
                       printable(input, 4096) + "'");
  const auto fail = [&path](const std::string& reason) {
    throw CannotWrite(printable(path, 4096) + ": cannot be written: " + reason);
  };
  if (fs::is_directory(path, error)) fail("is a directory");
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty() && !fs::is_directory(folder, error))
    fail("there is no folder " + printable(folder.string(), 4096));
  if (!fs::exists(path, error) && ::access(folder.empty() ? "." : folder.c_str(), W_OK) != 0)
    fail(std::strerror(errno));
}

std::string json_beside_out(const Arguments& arguments) {
  if (arguments.has("json")) return arguments.text("json");
  return std::filesystem::path(arguments.text("out")).replace_extension(".json");
}

}  // namespace backlash::tools
