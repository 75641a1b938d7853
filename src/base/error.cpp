// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/error.h"

#include <sstream>

namespace backlash {
namespace {

std::string to_text(double value) {
  std::ostringstream text;
  text.precision(12);
  text << value;
  return text.str();
}

}  // namespace

InvalidParameter::InvalidParameter(const std::string& name, const std::string& value,
                                   const std::string& limit)
    : Error(name + " = " + value + ": " + limit), name_(name), value_(value), limit_(limit) {}

InvalidParameter::InvalidParameter(const std::string& name, double value, const std::string& limit)
    : InvalidParameter(name, to_text(value), limit) {}

}  // namespace backlash
