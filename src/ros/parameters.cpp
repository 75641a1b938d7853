// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/parameters.h"

#include <fmt/format.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <cmath>
#include <sstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::ros_bridge {
namespace {

// What dynamic_reconfigure left of joints that this node had before.
constexpr const char* kLiveBelow = "/live/";

std::string shown(XmlRpc::XmlRpcValue value) {
  if (value.getType() == XmlRpc::XmlRpcValue::TypeString) return static_cast<std::string>(value);
  std::ostringstream text;
  value.write(text);
  return printable(text.str());
}

bool is_number(const XmlRpc::XmlRpcValue& value) {
  return value.getType() == XmlRpc::XmlRpcValue::TypeDouble ||
         value.getType() == XmlRpc::XmlRpcValue::TypeInt;
}

/// Of a number that came as text.
std::string hint(XmlRpc::XmlRpcValue value) {
  if (value.getType() != XmlRpc::XmlRpcValue::TypeString) return "";
  const bool is_one = static_cast<bool>(parse_number(static_cast<std::string>(value)));
  return is_one ? ", this is text: YAML takes 2e-5 for text, write 2.0e-5" : "";
}

}  // namespace

Parameters::Parameters(const ros::NodeHandle& private_handle) : handle_(private_handle) {}

XmlRpc::XmlRpcValue Parameters::value(const std::string& name, bool& present) {
  known_.insert(name);
  XmlRpc::XmlRpcValue value;
  present = handle_.getParam(name, value);
  return value;
}

bool Parameters::has(const std::string& name) {
  return handle_.hasParam(name);
}

void Parameters::allow(const std::string& name) {
  known_.insert(name);
}

double Parameters::number(const std::string& name, double absent, const Range& range) {
  bool present;
  XmlRpc::XmlRpcValue found = value(name, present);
  if (!present) return absent;
  if (!is_number(found)) throw InvalidParameter("~" + name, shown(found), "must be a number" + hint(found));
  const double number =
      found.getType() == XmlRpc::XmlRpcValue::TypeInt ? static_cast<int>(found) : static_cast<double>(found);
  if (!std::isfinite(number)) throw InvalidParameter("~" + name, number, "must be finite");
  if (!range.contains(number)) throw InvalidParameter("~" + name, number, range.text());
  return number;
}

long Parameters::integer(const std::string& name, long absent, long lower, long upper) {
  bool present;
  XmlRpc::XmlRpcValue found = value(name, present);
  if (!present) return absent;
  if (found.getType() != XmlRpc::XmlRpcValue::TypeInt)
    throw InvalidParameter("~" + name, shown(found), "must be a whole number");
  const long number = static_cast<int>(found);
  if (number < lower || number > upper)
    throw InvalidParameter("~" + name, fmt::to_string(number),
                           fmt::format("must be between {} and {}", lower, upper));
  return number;
}

bool Parameters::boolean(const std::string& name, bool absent) {
  bool present;
  XmlRpc::XmlRpcValue found = value(name, present);
  if (!present) return absent;
  if (found.getType() != XmlRpc::XmlRpcValue::TypeBoolean)
    throw InvalidParameter("~" + name, shown(found), "must be true or false");
  return static_cast<bool>(found);
}

std::string Parameters::text(const std::string& name, const std::string& absent) {
  bool present;
  XmlRpc::XmlRpcValue found = value(name, present);
  if (!present) return absent;
  if (found.getType() != XmlRpc::XmlRpcValue::TypeString)
    throw InvalidParameter("~" + name, shown(found), "must be text");
  return static_cast<std::string>(found);
}

std::vector<std::string> Parameters::texts(const std::string& name, const std::vector<std::string>& absent) {
  bool present;
  XmlRpc::XmlRpcValue found = value(name, present);
  if (!present) return absent;
  if (found.getType() != XmlRpc::XmlRpcValue::TypeArray || found.size() == 0)
    throw InvalidParameter("~" + name, shown(found), "must be a list of names");
  std::vector<std::string> texts;
  for (int i = 0; i < found.size(); ++i) {  // NOLINT(modernize-loop-convert): begin() is of a struct
    if (found[i].getType() != XmlRpc::XmlRpcValue::TypeString)
      throw InvalidParameter("~" + name, shown(found[i]), "must be text");
    texts.push_back(static_cast<std::string>(found[i]));
  }
  return texts;
}

void Parameters::finish() const {
  std::vector<std::string> all;
  handle_.getParamNames(all);
  const std::string prefix = handle_.getNamespace() + "/";
  for (const std::string& full : all) {
    if (full.compare(0, prefix.size(), prefix) != 0) continue;
    const std::string name = full.substr(prefix.size());
    bool known = name.find(kLiveBelow) != std::string::npos;
    for (const std::string& k : known_)
      known = known || name == k || name.compare(0, k.size() + 1, k + "/") == 0;
    if (!known)
      throw InvalidParameter("~" + name, "given",
                             "is not a parameter of this node; known: " + joined(known_));
  }
}

}  // namespace backlash::ros_bridge
