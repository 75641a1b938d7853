// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/joint_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::ros_bridge {
namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

double& at(record::ChannelValues& values, record::Channel channel) {
  return values[static_cast<std::size_t>(channel)];
}

/// What is wrong with the length of an array; nothing where it is empty or has a value per name.
std::string size_problem(const std::vector<double>& array, const char* name, std::size_t joints) {
  if (array.empty() || array.size() == joints) return {};
  return fmt::format("{} has {} values for {} names", name, array.size(), joints);
}

std::string size_problem(const sensor_msgs::JointState& m) {
  std::string problem = size_problem(m.position, "position", m.name.size());
  if (problem.empty()) problem = size_problem(m.velocity, "velocity", m.name.size());
  if (problem.empty()) problem = size_problem(m.effort, "effort", m.name.size());
  return problem;
}

const std::vector<double>& array_of(const sensor_msgs::JointState& m, record::Field field) {
  return field == record::Field::position   ? m.position
         : field == record::Field::velocity ? m.velocity
                                            : m.effort;
}

/// Adds one joint; arrays stay parallel, they are emptied at the end where nobody has the quantity.
void add(sensor_msgs::JointState& m, const std::string& name, double position, double velocity,
         double effort) {
  if (std::isnan(position) && std::isnan(velocity) && std::isnan(effort)) return;
  m.name.push_back(name);
  m.position.push_back(position);
  m.velocity.push_back(velocity);
  m.effort.push_back(effort);
}

double value(const model::Observation& o, record::Channel channel) {
  switch (channel) {
    case record::Channel::motor_torque:
      return o.motor_torque;
    case record::Channel::motor_position:
      return o.motor_position;
    case record::Channel::motor_velocity:
      return o.motor_velocity;
    case record::Channel::sensor_torque:
      return o.sensor_torque;
    case record::Channel::load_position:
      return o.load_position;
    case record::Channel::load_velocity:
      return o.load_velocity;
    case record::Channel::output_torque:
      return o.output_torque;
    case record::Channel::motor_current:
      return o.motor_current;
    case record::Channel::acceleration:
      return o.acceleration;
    case record::Channel::reference_position:
      return kAbsent;
  }
  return kAbsent;
}

void empty_if_absent(std::vector<double>& array) {
  if (std::all_of(array.begin(), array.end(), [](double v) { return std::isnan(v); })) array.clear();
}

}  // namespace

void empty_if_absent(sensor_msgs::JointState& m) {
  empty_if_absent(m.position);
  empty_if_absent(m.velocity);
  empty_if_absent(m.effort);
}

JointNames::JointNames(const std::string& joint)
    : robot(joint),
      motor(joint + "_motor"),
      sensor(joint + "_sensor"),
      load(joint + "_load"),
      reference(joint + "_reference"),
      current(joint + "_current"),
      accelerometer(joint + "_accelerometer") {}

double StampClock::seconds(const ros::Time& stamp) {
  if (!started_) {
    started_ = true;
    origin_ = stamp;
  }
  // The double that a CSV with nine decimals would give, so that times survive the way through a bag bit by
  // bit.
  constexpr double kExactIntegers = 9007199254740992.0;  // 2^53
  const double whole = double(stamp.sec) - double(origin_.sec);
  const double rest = double(stamp.nsec) - double(origin_.nsec);
  const double nanoseconds = whole * 1e9 + rest;
  return std::fabs(nanoseconds) < kExactIntegers ? nanoseconds / 1e9 : whole + rest * 1e-9;
}

JointStateReader::JointStateReader(const std::vector<record::ChannelMap>& joints) : readings_(joints.size()) {
  for (std::size_t joint = 0; joint < joints.size(); ++joint) {
    unsigned bit = 1;
    for (const record::ChannelSource& source : joints[joint].sources) {
      std::vector<Place>& places = places_[source.name];
      if (places.empty() || places.back().joint != joint) {
        places.push_back({joint, bit, true, {}});
        bit <<= 1U;
      }
      places.back().sources.push_back(source);
      if (source.channel != record::Channel::reference_position) places.back().set_point = false;
    }
    readings_[joint].values.fill(kAbsent);
  }
  seen_.reserve(joints.size());
  mentioned_.reserve(joints.size());
}

const std::vector<std::size_t>& JointStateReader::read(const sensor_msgs::JointState& message) {
  for (const std::size_t joint : seen_) {
    readings_[joint].values.fill(kAbsent);
    readings_[joint].problem.clear();
    readings_[joint].seen = 0;
    readings_[joint].any = false;
  }
  seen_.clear();
  mentioned_.clear();
  const std::string wrong_size = size_problem(message);
  for (std::size_t i = 0; i < message.name.size(); ++i) {
    const auto places = places_.find(message.name[i]);
    if (places == places_.end()) continue;
    for (const Place& place : places->second) {
      Reading& reading = readings_[place.joint];
      if (reading.seen == 0) seen_.push_back(place.joint);
      if (!reading.any && !place.set_point) {
        reading.any = true;
        mentioned_.push_back(place.joint);
      }
      if (reading.problem.empty()) reading.problem = wrong_size;
      if (reading.problem.empty() && (reading.seen & place.bit) != 0)
        reading.problem = "the name " + printable(message.name[i]) + " appears twice";
      reading.seen |= place.bit;
      if (reading.problem.empty()) take(message, i, place, reading);
    }
  }
  return mentioned_;
}

void JointStateReader::take(const sensor_msgs::JointState& m, std::size_t i, const Place& place,
                            Reading& reading) {
  for (const record::ChannelSource& source : place.sources) {
    const std::vector<double>& array = array_of(m, source.field);
    if (array.empty()) continue;
    if (std::isinf(array[i]))
      reading.problem = m.name[i] + " " + record::field_name(source.field) + " is infinite";
    double& value = at(reading.values, source.channel);
    value = source.scale * array[i];
    if (source.offset != 0) value += source.offset;  // else -0.0 stays what it is
  }
}

record::ChannelValues read_joint_state(const sensor_msgs::JointState& m, const std::string& joint,
                                       const std::string& topic) {
  JointStateReader reader({record::usual_channels(joint)});
  reader.read(m);
  if (!reader.problem(0).empty()) throw BadData(topic, reader.problem(0));
  return reader.values(0);
}

void add_joint_state(const model::Observation& o, const JointNames& names, sensor_msgs::JointState& m) {
  add(m, names.motor, o.motor_position, o.motor_velocity, o.motor_torque);
  add(m, names.sensor, o.sensor_twist, o.sensor_twist_rate, o.sensor_torque);
  add(m, names.load, o.load_position, o.load_velocity, o.output_torque);
  add(m, names.current, kAbsent, kAbsent, o.motor_current);
  add(m, names.accelerometer, kAbsent, kAbsent, o.acceleration);
}

void add_robot_joint(const model::Observation& o, const std::string& joint, sensor_msgs::JointState& m) {
  add(m, joint, o.load_position, o.load_velocity, o.motor_torque);
}

void add_held_joint(const std::string& joint, double position, sensor_msgs::JointState& m) {
  add(m, joint, position, 0, kAbsent);
}

JointStateWriter::JointStateWriter(const record::ChannelMap& sources) {
  for (const record::ChannelSource& source : sources.sources) {
    auto name =
        std::find_if(names_.begin(), names_.end(), [&](const Name& n) { return n.name == source.name; });
    if (name == names_.end()) name = names_.insert(names_.end(), {source.name, {}});
    name->sources.push_back(source);
  }
}

void JointStateWriter::add(const model::Observation& o, sensor_msgs::JointState& m) const {
  for (const Name& name : names_) {
    double position = kAbsent, velocity = kAbsent, effort = kAbsent;
    for (const record::ChannelSource& s : name.sources) {
      double& field = s.field == record::Field::position   ? position
                      : s.field == record::Field::velocity ? velocity
                                                           : effort;
      field = (value(o, s.channel) - s.offset) / s.scale;
    }
    ros_bridge::add(m, name.name, position, velocity, effort);
  }
}

sensor_msgs::JointState make_joint_state(const model::Observation& o, const JointNames& names) {
  sensor_msgs::JointState m;
  add_joint_state(o, names, m);
  return m;
}

void add_joint_state(const record::Record& record, std::size_t i, const JointNames& names,
                     sensor_msgs::JointState& m) {
  const auto get = [&record, i](record::Channel channel) {
    return record.has(channel) ? record.column(channel)[i] : kAbsent;
  };
  add(m, names.motor, get(record::Channel::motor_position), get(record::Channel::motor_velocity),
      get(record::Channel::motor_torque));
  add(m, names.sensor, kAbsent, kAbsent, get(record::Channel::sensor_torque));
  add(m, names.load, get(record::Channel::load_position), get(record::Channel::load_velocity),
      get(record::Channel::output_torque));
  add(m, names.reference, get(record::Channel::reference_position), kAbsent, kAbsent);
  add(m, names.current, kAbsent, kAbsent, get(record::Channel::motor_current));
  add(m, names.accelerometer, kAbsent, kAbsent, get(record::Channel::acceleration));
}

sensor_msgs::JointState make_joint_state(const record::Record& record, std::size_t i,
                                         const JointNames& names) {
  sensor_msgs::JointState m;
  add_joint_state(record, i, names, m);
  empty_if_absent(m);
  return m;
}

}  // namespace backlash::ros_bridge
