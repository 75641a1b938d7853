// SPDX-License-Identifier: BSD-3-Clause
// A value from data, with its standard error.
#pragma once

#include <limits>

#include "backlash_diagnosis/base/error.h"

namespace backlash {

/// A value and its standard error, both in the same unit; NaN: not known.
struct Measured {
  double value = std::numeric_limits<double>::quiet_NaN();
  double standard_error = std::numeric_limits<double>::quiet_NaN();
};

/// Thrown by a procedure where the record does not contain the information it needs; the message says why in
/// one sentence and with figures.
class CannotIdentify : public Error {
 public:
  using Error::Error;
};

}  // namespace backlash
