// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/measured_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace backlash::signal {

ValueText value_text(const Measured& m) {
  if (!(m.standard_error > 0) || !std::isfinite(m.standard_error))
    return {fmt::format("{:.6g}", m.value), ""};
  // As many digits as the error leaves, which has two.
  const double size = std::max(std::fabs(m.value), m.standard_error);
  const int digits = 2 + int(std::floor(std::log10(size)) - std::floor(std::log10(m.standard_error)));
  return {fmt::format("{:.{}g}", m.value, std::min(digits, 9)), fmt::format("{:.2g}", m.standard_error)};
}

std::string with_error(const Measured& m) {
  const ValueText text = value_text(m);
  return text.error.empty() ? text.value : text.value + " +- " + text.error;
}

}  // namespace backlash::signal
