// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/error.h"

#include <fmt/core.h>

namespace backlash {

InvalidParameter::InvalidParameter(const std::string& name, const std::string& value,
                                   const std::string& limit)
    : Error(name + " = " + value + ": " + limit), name_(name), value_(value), limit_(limit) {}

InvalidParameter::InvalidParameter(const std::string& name, double value, const std::string& limit)
    : InvalidParameter(name, fmt::format("{:.12g}", value), limit) {}

}  // namespace backlash
