// SPDX-License-Identifier: BSD-3-Clause
// JSON as the reports write it: what is not known is null, bytes that are not UTF-8 are replaced.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "backlash_diagnosis/signal/measured.h"

namespace backlash {

using Json = nlohmann::ordered_json;

/// Null for what is not finite.
Json number(double value);

/// value, standard_error
Json measured(const Measured& m);

/// With a newline at the end; `indent` -1: on one line.
std::string dumped(const Json& json, int indent);

}  // namespace backlash
