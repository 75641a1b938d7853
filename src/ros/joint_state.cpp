#include "backlash_diagnosis/ros/joint_state.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash {
namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

double& at(ChannelValues& values, Channel channel) { return values[static_cast<std::size_t>(channel)]; }

void check_size(const std::vector<double>& array, const char* name, std::size_t joints, const std::string& topic) {
  if (array.empty() || array.size() == joints) return;
  throw BadData(topic, std::string(name) + " has " + std::to_string(array.size()) + " values for " +
                           std::to_string(joints) + " names");
}

double value(const std::vector<double>& array, std::size_t i, const char* what, const std::string& joint,
             const std::string& topic) {
  if (array.empty()) return kAbsent;
  if (std::isinf(array[i])) throw BadData(topic, joint + " " + what + " is infinite");
  return array[i];
}

/// Adds one joint; arrays stay parallel, they are emptied at the end where nobody has the quantity.
void add(sensor_msgs::JointState& m, const std::string& name, double position, double velocity, double effort) {
  if (std::isnan(position) && std::isnan(velocity) && std::isnan(effort)) return;
  m.name.push_back(name);
  m.position.push_back(position);
  m.velocity.push_back(velocity);
  m.effort.push_back(effort);
}

void empty_if_absent(std::vector<double>& array) {
  if (std::all_of(array.begin(), array.end(), [](double v) { return std::isnan(v); })) array.clear();
}

}  // namespace

JointNames::JointNames(const std::string& joint)
    : motor(joint + "_motor"), sensor(joint + "_sensor"), load(joint + "_load"), reference(joint + "_reference"),
      current(joint + "_current"), accelerometer(joint + "_accelerometer") {}

double StampClock::seconds(const ros::Time& stamp) {
  if (!started_) {
    started_ = true;
    origin_ = stamp;
  }
  // The double that a CSV with nine decimals would give, so that times survive the way through a bag bit by bit.
  constexpr double kExactIntegers = 9007199254740992.0;  // 2^53
  const double whole = double(stamp.sec) - double(origin_.sec);
  const double rest = double(stamp.nsec) - double(origin_.nsec);
  const double nanoseconds = whole * 1e9 + rest;
  return std::fabs(nanoseconds) < kExactIntegers ? nanoseconds / 1e9 : whole + rest * 1e-9;
}

bool mentions(const sensor_msgs::JointState& message, const JointNames& names) {
  for (const std::string& name : message.name)
    if (name == names.motor || name == names.sensor || name == names.load || name == names.current ||
        name == names.accelerometer)
      return true;
  return false;
}

ChannelValues read_joint_state(const sensor_msgs::JointState& m, const JointNames& names, const std::string& topic) {
  check_size(m.position, "position", m.name.size(), topic);
  check_size(m.velocity, "velocity", m.name.size(), topic);
  check_size(m.effort, "effort", m.name.size(), topic);
  ChannelValues values;
  values.fill(kAbsent);
  const std::string* seen[6] = {};
  for (std::size_t i = 0; i < m.name.size(); ++i) {
    const std::string& name = m.name[i];
    const std::string* const known[] = {&names.motor,     &names.sensor,  &names.load,
                                        &names.reference, &names.current, &names.accelerometer};
    const auto which = std::find_if(std::begin(known), std::end(known), [&](auto* k) { return *k == name; });
    if (which == std::end(known)) continue;
    const std::size_t slot = which - std::begin(known);
    if (seen[slot]) throw BadData(topic, "the name " + printable(name) + " appears twice");
    seen[slot] = &name;
    const double position = value(m.position, i, "position", name, topic);
    const double velocity = value(m.velocity, i, "velocity", name, topic);
    const double effort = value(m.effort, i, "effort", name, topic);
    if (slot == 0) {
      at(values, Channel::motor_position) = position;
      at(values, Channel::motor_velocity) = velocity;
      at(values, Channel::motor_torque) = effort;
    } else if (slot == 1) {
      at(values, Channel::sensor_torque) = effort;
    } else if (slot == 2) {
      at(values, Channel::load_position) = position;
      at(values, Channel::load_velocity) = velocity;
    } else if (slot == 3) {
      at(values, Channel::reference_position) = position;
    } else {
      at(values, slot == 4 ? Channel::motor_current : Channel::acceleration) = effort;
    }
  }
  return values;
}

sensor_msgs::JointState make_joint_state(const Observation& o, const JointNames& names) {
  sensor_msgs::JointState m;
  add(m, names.motor, o.motor_position, o.motor_velocity, o.motor_torque);
  add(m, names.sensor, o.sensor_twist, o.sensor_twist_rate, o.sensor_torque);
  add(m, names.load, o.load_position, o.load_velocity, o.load_torque);
  add(m, names.current, kAbsent, kAbsent, o.motor_current);
  add(m, names.accelerometer, kAbsent, kAbsent, o.acceleration);
  return m;
}

sensor_msgs::JointState make_joint_state(const Record& record, std::size_t i, const JointNames& names) {
  const auto get = [&record, i](Channel channel) { return record.has(channel) ? record.column(channel)[i] : kAbsent; };
  sensor_msgs::JointState m;
  add(m, names.motor, get(Channel::motor_position), get(Channel::motor_velocity), get(Channel::motor_torque));
  add(m, names.sensor, kAbsent, kAbsent, get(Channel::sensor_torque));
  add(m, names.load, get(Channel::load_position), get(Channel::load_velocity), kAbsent);
  add(m, names.reference, get(Channel::reference_position), kAbsent, kAbsent);
  add(m, names.current, kAbsent, kAbsent, get(Channel::motor_current));
  add(m, names.accelerometer, kAbsent, kAbsent, get(Channel::acceleration));
  empty_if_absent(m.position);
  empty_if_absent(m.velocity);
  empty_if_absent(m.effort);
  return m;
}

}  // namespace backlash
