// SPDX-License-Identifier: BSD-3-Clause
// Where the channels of one joint come from: which topic, which name in its messages, which of their fields,
// or which column of a CSV, and what must be done to the value. A robot and a test bench have names and units
// of their own; this says what they are.
//
//   channel = scale * field + offset
//   channel = scale * (column in SI) + offset
//   channel = scale * (sum or product of columns, in SI) + offset
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

/// The arrays of sensor_msgs/JointState.
enum class Field { position, velocity, effort };

const char* field_name(Field field);
std::optional<Field> field_from_name(const std::string& name);

/// The field that carries a channel where nothing else is said: sensor_msgs/JointState has none for a current
/// or an acceleration, which are put where a torque would be.
Field usual_field(Channel channel);

struct ChannelSource {
  Channel channel = Channel::motor_position;
  std::string topic = "joint_states";
  std::string name;  // in the messages
  Field field = Field::position;
  double scale = 1;       // unit of the channel over that of the field, != 0; < 0 turns the sign
  double offset = 0;      // unit of the channel
  bool optional = false;  // a record without it is read as well
};

/// A column of a file that has names and units of its own, or what is computed from several of them.
struct ColumnSource {
  Channel channel = Channel::motor_position;  // means nothing for the time and for parts of a sum or product
  std::string column;       // as in the header, with or without the unit there; else its number, from 1
  std::size_t element = 0;  // of a column with several numbers in a field, "(1, 2, 3)", from 1; 0: it has one
  int bits = 0;             // of a signed number that the file holds as one without a sign; 0: it does not
  std::string unit;         // where the file does not say it (record/unit.h); of a computed one always
  std::optional<double> scale;             // unit of the channel over the SI unit of the column, != 0
  double offset = 0;                       // unit of the channel
  std::vector<ColumnSource> sum, product;  // of these, in SI units, instead of a column

  bool is_computed() const { return !sum.empty() || !product.empty(); }
};

struct ChannelMap {
  std::string joint;  // what the joint is called in answers
  std::vector<ChannelSource> sources;
  bool declared = false;  // `sources` by the rig file or a parameter; else the names that this package gives
  std::vector<ColumnSource> columns;  // of a CSV, JSON or .npz; empty: the package's own format only
  ColumnSource time;                  // of the same file
  double rate = 0;                    // Hz, of a file whose rows have no time; 0: `time` says it
  bool linear = false;                // the axis: m and N for rad and N m

  /// All topics, that of the motor's position (else of the first source) first: its stamps count.
  std::vector<std::string> topics() const;
  /// The sources on a topic.
  ChannelMap on(const std::string& topic) const;
};

/// The names that this package gives, all on joint_states:
///   <joint>_motor           position = motor_position   velocity = motor_velocity   effort = motor_torque
///   <joint>_sensor                                                                  effort = sensor_torque
///   <joint>_load            position = load_position    velocity = load_velocity    effort = output_torque
///   <joint>_reference       position = reference_position
///   <joint>_current                                                                 effort = motor_current
///   <joint>_accelerometer                                                           effort = acceleration
ChannelMap usual_channels(const std::string& joint);

extern const std::string kTimeColumn;  ///< "time", of a CSV in the package's own format

/// Whether a file in the package's own format may have a column of that name: `time`, a channel,
/// JOINT/channel.
bool is_own_column(std::string_view name);

/// Throws InvalidParameter for a channel twice, no channel that shows backlash, an empty name or topic, a
/// scale of 0, a scale or offset that is not finite; of columns also for none with the time and no rate, a
/// unit that is unknown or of another kind, a sum or product without one, and one of the package's own names
/// (`time`, `motor_position`) that means anything but what it is: no file in the package's own format may be
/// read as something else.
void check(const ChannelMap& map);

}  // namespace backlash::record
