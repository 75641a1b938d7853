// SPDX-License-Identifier: BSD-3-Clause
// A value from data, with its standard error.
#pragma once

#include <limits>

namespace backlash::signal {

/// A value and its standard error, both in the same unit; NaN: not known.
struct Measured {
  double value = std::numeric_limits<double>::quiet_NaN();
  double standard_error = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace backlash::signal
