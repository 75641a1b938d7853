// SPDX-License-Identifier: BSD-3-Clause
#include "json.h"

#include <cmath>

namespace backlash {

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json measured(const Measured& m) {
  return {{"value", number(m.value)}, {"standard_error", number(m.standard_error)}};
}

std::string dumped(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace backlash
