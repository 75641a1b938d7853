// SPDX-License-Identifier: BSD-3-Clause
// Errors of values that a fit can hardly separate.
#pragma once

#include <map>
#include <string>

#include "multi_start.h"

namespace backlash::identification {

/// If values can hardly be separated, the sum of squares has a valley with many small minima (from
/// standstills and touches of the load), and a fit may end in any of them. So fits are started beside the end
/// of the first. The best is taken. Over the others with nearly the same residual, the root mean square
/// distance of each value from the best is its error, by name and in its unit. Empty if the rows separate all
/// values.
std::map<std::string, double> search_valley(BandFit& fitted, const FitSettings& settings);

}  // namespace backlash::identification
