// SPDX-License-Identifier: BSD-3-Clause
// Numbers in JSON, which has neither NaN nor infinity.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

namespace backlash {

/// null for NaN and infinities.
inline nlohmann::ordered_json json_number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

/// [lower, upper]: one null is an open end; null where neither end is known.
inline nlohmann::ordered_json json_interval(double lower, double upper) {
  if (!std::isfinite(lower) && !std::isfinite(upper)) return nullptr;
  return nlohmann::ordered_json::array({json_number(lower), json_number(upper)});
}

}  // namespace backlash
