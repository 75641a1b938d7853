// SPDX-License-Identifier: BSD-3-Clause
// Where a fit ends whose values nearly mix.
#pragma once

#include <map>
#include <string>

#include "multi_start.h"

namespace backlash::identification {

/// Where values nearly mix, the sum of squares has a valley, made rough by standstills and touches of the
/// load: a fit may end anywhere in it. Fits that begin beside its end show where else. The best is taken; of
/// the others that leave hardly more, the root mean square of the distance to it is an error of each value,
/// by its name and in its unit. Empty where the rows distinguish all values.
std::map<std::string, double> search_valley(BandFit& fitted, const FitSettings& settings);

}  // namespace backlash::identification
