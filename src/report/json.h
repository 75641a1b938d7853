// SPDX-License-Identifier: BSD-3-Clause
// JSON as the reports write it: what is not known is null, bytes that are not UTF-8 are replaced.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "backlash_diagnosis/signal/measured.h"

namespace backlash::report {

using Json = nlohmann::ordered_json;

/// Null for NaN and infinities.
Json json_number(double value);

/// [lower, upper]: one null is an open end; null where neither end is known.
Json json_interval(double lower, double upper);

/// value, standard_error
Json measured(const signal::Measured& m);

/// With a newline at the end; `indent` -1: on one line.
std::string dumped(const Json& json, int indent);

}  // namespace backlash::report
