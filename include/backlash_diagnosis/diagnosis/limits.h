// SPDX-License-Identifier: BSD-3-Clause
// What backlash is too much: the limits by which a verdict grades.
#pragma once

#include <string>

#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::diagnosis {

/// Backlash from which a grade begins, by experience with the machine: in m (`backlash`) or rad
/// (`backlash_angle`). With a baseline they limit the growth since then.
struct Limits {
  bool angular = false;
  double watch = 0, service = 0, stop = 0;
};

/// The one rule for limits, wherever they come from: 0 < watch < service < stop, all finite. Throws
/// InvalidParameter with the name of the first one that breaks it.
void require_increasing(const Limits& limits);

/// The map `backlash` or `backlash_angle` with `watch`, `service` and `stop`. Throws BadData.
Limits read_limits(const YamlReader& yaml);

/// A file of their own: schema_version 1 and that map. Throws MissingInput, BadData.
Limits read_limits_file(const std::string& path);

/// Throws BadData where limits in m meet a machine whose backlash is known as an angle only.
void check_limits(const Limits& limits, bool angular_machine, const std::string& source);

}  // namespace backlash::diagnosis
