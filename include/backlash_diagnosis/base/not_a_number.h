// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

namespace backlash {

/// A number that is not known.
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace backlash
