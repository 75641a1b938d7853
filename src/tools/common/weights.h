// SPDX-License-Identifier: BSD-3-Clause
// What a machine carries in a record, as the option --payload says it:
//   --payload "2.805 kg +- 0.005"            of the first RECORD
//   --payload RECORD="2 kg +- 1 % at 0.15 m" of that RECORD; once for each that carries something
//   --payload RECORD=unknown                 something that nobody has weighed
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/signal/measured.h"
#include "tools/common/command_line.h"

namespace backlash::tools {

struct Weight {
  std::optional<signal::Measured> mass;  // kg, > 0; an error of 0: exact; none: unknown
  std::optional<double> lever;           // m, > 0, of its centre from the axis of a single joint
};

/// "MASS kg [+- ERROR [kg | g | %]] [at LEVER m]" or "unknown"; the masses in kg or g, the lever in m or mm.
/// Throws UsageError.
Weight parse_weight(const std::string& text);

/// Of each positional RECORD; none: it carries nothing. Throws UsageError where a value names no record, or
/// one twice.
std::vector<std::optional<Weight>> weights_of(const Arguments& arguments);

}  // namespace backlash::tools
