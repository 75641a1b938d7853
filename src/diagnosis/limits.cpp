// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/limits.h"

#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::diagnosis {

void require_increasing(const Limits& limits) {
  const auto require = [](const char* name, double value, double above, const char* limit) {
    if (!std::isfinite(value) || !(value > above)) throw InvalidParameter(name, value, limit);
  };
  require("watch", limits.watch, 0, "must be > 0");
  require("service", limits.service, limits.watch, "must be > watch");
  require("stop", limits.stop, limits.service, "must be > service");
}

Limits read_limits(const YamlReader& yaml) {
  Limits limits;
  limits.angular = yaml.has("backlash_angle");
  const YamlReader values = yaml.map(limits.angular ? "backlash_angle" : "backlash");
  limits.watch = values.number("watch", Range::positive());
  limits.service = values.number("service", Range::positive());
  limits.stop = values.number("stop", Range::positive());
  try {
    require_increasing(limits);
  } catch (const InvalidParameter& error) {
    values.fail(error.name(), error.limit());
  }
  return limits;
}

Limits read_limits_file(const std::string& path) {
  const YamlReader yaml = YamlReader::from_file(path);
  yaml.integer("schema_version", 1, 1);
  const Limits limits = read_limits(yaml);
  yaml.finish();
  return limits;
}

void check_limits(const Limits& limits, bool angular_machine, const std::string& source) {
  if (angular_machine && !limits.angular)
    throw BadData(source, "a rig without base_radius needs limits of backlash_angle");
}

}  // namespace backlash::diagnosis
