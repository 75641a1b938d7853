// SPDX-License-Identifier: BSD-3-Clause
// A number with its error, as people read it.
#pragma once

#include <string>

#include "backlash_diagnosis/signal/measured.h"

namespace backlash::signal {

struct ValueText {
  std::string value;  // rounded to the place of the error's last digit
  std::string error;  // two digits; empty if it is unknown or 0
};

ValueText value_text(const Measured& m);

/// "1.234 +- 0.056"; the value alone if the error is unknown or 0.
std::string with_error(const Measured& m);

}  // namespace backlash::signal
