// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>

#include "backlash_diagnosis/identification/several_machines.h"
#include "report/json.h"

namespace backlash::findings {

/// {"together": x, "differ": [names], "records": [{"record", "left", "parameters": {name: value}}]}; null for
/// none.
report::Json several_json(const std::optional<identification::SeveralMachines>& several,
                          const std::map<std::string, std::string>& units, bool linear);

}  // namespace backlash::findings
