// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/utc.h"

#include <fmt/core.h>

#include <cmath>
#include <ctime>

namespace backlash {

std::string utc_time(double time) {
  constexpr double kYear0 = -62167219200, kYear10000 = 253402300800;
  if (!(time >= kYear0 && time < kYear10000)) return {};
  const auto seconds = static_cast<std::time_t>(std::floor(time));
  std::tm parts{};
  if (::gmtime_r(&seconds, &parts) == nullptr) return {};
  // By hand: the year of %F has no leading zeros everywhere.
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z", parts.tm_year + 1900, parts.tm_mon + 1,
                     parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec);
}

std::string utc_date(double time) {
  return utc_time(time).substr(0, 10);
}

}  // namespace backlash
