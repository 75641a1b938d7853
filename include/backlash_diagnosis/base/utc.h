// SPDX-License-Identifier: BSD-3-Clause
// Times in seconds since 1970 as people read them: UTC, after ISO 8601.
#pragma once

#include <string>

namespace backlash {

std::string utc_time(double time);  ///< "2027-03-01T12:30:05Z"; empty outside the years 0 to 9999
std::string utc_date(double time);  ///< "2027-03-01"

}  // namespace backlash
