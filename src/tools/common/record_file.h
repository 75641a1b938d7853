// SPDX-License-Identifier: BSD-3-Clause
// Records as files whose extension gives the format, and what is checked about files before long work begins.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/record/channel_map.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::tools {

extern const std::string kDefaultJoint;  ///< "joint"

/// Where in a bag or a CSV the record is.
struct BagPlace {
  std::string joint;                   ///< empty: the only one there is
  std::string topic = "joint_states";  ///< of a bag
  record::ChannelMap channels;         ///< of a bag where it is declared, of a CSV where it has columns
};

/// Where the joint of a rig file is.
BagPlace place_of(const rig_file::RigFile& file);

/// Throws UsageError for a path that is none of .csv, .bag, .mcap, .db3 and a folder of rosbag2.
void check_record_path(const std::string& path);

/// Throws UsageError for a path that is none of .csv, .bag, .mcap.
void check_written_path(const std::string& path);

/// Throws UsageError as above and what read_csv and read_bag throw.
record::Record read_record(const std::string& path, const BagPlace& place = {});

/// Not interrupted by Ctrl-C: the file is written whole or not at all. Throws as write_csv and write_bag.
void write_record(const record::Record& record, const std::string& path, const std::string& joint);
/// The same for several joints with one time base.
void write_joints(const std::vector<record::JointRecord>& joints, const std::string& path);

/// The same for any text file.
void write_text(const std::string& path, const std::string& text);

/// As the name of a file to write: standard output.
inline const std::string kStandardOutput = "-";

/// Throws UsageError where the output would overwrite one of the inputs, CannotWrite where its folder does
/// not exist or it is a folder itself.
void check_output(const std::string& path, const std::vector<std::string>& inputs);

class Arguments;

/// Where the JSON of a command goes that writes --out: --json, else that file's name with .json.
std::string json_beside_out(const Arguments& arguments);

}  // namespace backlash::tools
