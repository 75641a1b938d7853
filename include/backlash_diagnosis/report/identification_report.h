// SPDX-License-Identifier: BSD-3-Clause
// An identification as JSON and as text.
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "backlash_diagnosis/identification/identify.h"

namespace backlash::tools {

/// The `identify` JSON of the design: schema_version, procedures, parameters, channels, warnings; beyond that
/// what the plots need. Values at the load side of the reduction.
nlohmann::ordered_json to_json(const Identification& found);

void print_summary(const Identification& found, std::ostream& out);

}  // namespace backlash::tools
