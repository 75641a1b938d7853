// SPDX-License-Identifier: BSD-3-Clause
// The one loader for node parameters: private parameters with type, range and known names. What is wrong is
// refused with an InvalidParameter that names it; an absent parameter has the documented default of the call.
#pragma once

#include <ros/node_handle.h>

#include <set>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::ros_bridge {

class Parameters {
 public:
  explicit Parameters(const ros::NodeHandle& private_handle);

  double number(const std::string& name, double absent, const Range& range);
  long integer(const std::string& name, long absent, long lower, long upper);
  bool boolean(const std::string& name, bool absent);
  std::string text(const std::string& name, const std::string& absent);
  std::vector<std::string> texts(const std::string& name, const std::vector<std::string>& absent);
  bool has(const std::string& name);

  /// Marks a name (with everything below it) as known without reading it.
  void allow(const std::string& name);

  /// Throws InvalidParameter if the node has a private parameter that was never asked for.
  void finish() const;

 private:
  XmlRpc::XmlRpcValue value(const std::string& name, bool& present);

  ros::NodeHandle handle_;
  std::set<std::string> known_;
};

}  // namespace backlash::ros_bridge
