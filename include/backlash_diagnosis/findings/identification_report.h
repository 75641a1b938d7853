// SPDX-License-Identifier: BSD-3-Clause
// An identification as JSON and as text.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "backlash_diagnosis/identification/identify.h"

namespace backlash::findings {

/// The `identify` JSON of the design: schema_version, procedures, parameters, channels, warnings; beyond that
/// what the plots need, and the paths of the rig and of the records. Values at the load side of the
/// reduction.
std::string identification_json(const identification::Identification& found, const std::string& rig,
                                const std::vector<std::string>& records);

void print_summary(const identification::Identification& found, std::ostream& out);

}  // namespace backlash::findings
