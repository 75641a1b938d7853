// SPDX-License-Identifier: BSD-3-Clause
// Parameters of the simulator node that override what a rig file says.
#pragma once

#include <fmt/format.h>

#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/ros/parameters.h"
#include "backlash_diagnosis/simulation/sensor_model.h"

namespace backlash::ros_bridge {

/// Reads the parameters that override a rig file and remembers which were given: those below a scope ("" or
/// "JOINT/").
class GivenParameters {
 public:
  explicit GivenParameters(Parameters& parameters) : parameters_(parameters) {}

  void set_scope(const std::string& scope) { scope_ = scope; }
  const std::string& scope() const { return scope_; }

  bool has(const std::string& name) {
    if (!parameters_.has(scope_ + name)) parameters_.allow(scope_ + name);
    return parameters_.has(scope_ + name);
  }

  void number(const std::string& name, const Range& range, double& value) {
    if (!has(name)) return;
    value = parameters_.number(scope_ + name, value, range);
    add(name + " = " + to_text(value));
  }

  /// What the sensors of a joint and those of an arm have in common.
  void sensors(simulation::SensorsSettings& sensors) {
    const Range rates = Range::between(1e-3, 1e6);
    if (scope_.empty())
      number("sampling_rate", rates, sensors.sampling_rate);  // one message holds all joints
    if (!rates.contains(sensors.sampling_rate))
      throw InvalidParameter("sensors.sampling_rate", sensors.sampling_rate, rates.text());
    if (!has("seed")) return;
    sensors.seed = parameters_.integer(scope_ + "seed", 0, 0, std::numeric_limits<int>::max());
    add(fmt::format("seed = {}", sensors.seed));
  }

  void add(const std::string& given) { given_.push_back(given); }

  /// The text of a rig file after a line that says where it is from and what was given beside.
  std::string description(const std::string& source, const std::string& text) const {
    std::string line = "# source: " + printable(source, 1000);
    if (!given_.empty()) line += "; changed by parameters: " + joined(given_);
    return line + "\n" + text;
  }

 private:
  Parameters& parameters_;
  std::string scope_;
  std::vector<std::string> given_;
};

/// What reading a rig file throws, under the name of the parameter that names the file.
template <typename Read>
auto of_parameter(const std::string& name, const Read& read) {
  try {
    return read();
  } catch (const MissingInput& e) {
    throw MissingInput("~" + name + ": " + e.what());
  } catch (const Error& e) {
    throw BadData("~" + name, e.what());
  }
}

/// Whether topics and services can be below the name of a joint.
bool is_topic_name(const std::string& joint);

}  // namespace backlash::ros_bridge
