// SPDX-License-Identifier: BSD-3-Clause
#include "json.h"

#include <cmath>

namespace backlash::report {

Json json_number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json json_interval(double lower, double upper) {
  if (!std::isfinite(lower) && !std::isfinite(upper)) return nullptr;
  return Json::array({json_number(lower), json_number(upper)});
}

Json measured(const signal::Measured& m) {
  return {{"value", json_number(m.value)}, {"standard_error", json_number(m.standard_error)}};
}

std::string dumped(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace backlash::report
