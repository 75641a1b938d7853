// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/axis_unit.h"

#include <utility>

namespace backlash::model {

std::string axis_unit(const std::string& rotary, bool linear) {
  std::string unit = rotary;
  if (!linear) return unit;
  // In this order: the m of a torque goes before an angle becomes one. A force on a line stays what it is.
  const std::pair<const char*, const char*> rules[] = {
      {"kg m^2", "kg"}, {"(N m)", "N"}, {"N m", "N"}, {"rad", "m"}};
  for (const auto& [from, to] : rules)
    for (std::size_t at = 0; (at = unit.find(from, at)) != std::string::npos;)
      unit.replace(at, std::string(from).size(), to);
  return unit;
}

}  // namespace backlash::model
