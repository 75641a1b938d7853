// SPDX-License-Identifier: BSD-3-Clause
// A trend in one sentence.
#pragma once

#include <optional>
#include <string>

#include "backlash_diagnosis/diagnosis/trend.h"

namespace backlash::diagnosis {

/// Least data for a trend. Fewer values do not show their scatter; a machine warms up and cools down within a
/// day, and its backlash with it.
constexpr std::size_t kFewestTimes = 10;
constexpr double kShortestSpan = 86400;  // s

/// `times`: number of different times.
std::string trend_message(const Trend& trend, std::size_t times, std::optional<double> limit, bool angular);

}  // namespace backlash::diagnosis
