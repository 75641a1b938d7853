// SPDX-License-Identifier: BSD-3-Clause
// Test whether the residual correlates with the input: a complete model leaves independent noise.
#pragma once

#include <vector>

namespace backlash::identification {

/// Share of the lags 0, +-1 ... +-`lags` at which the correlation coefficient of residual and input lies
/// outside its 99 % band. The band allows for the colour of both (Bartlett 1955): variance sum rho_r(k)
/// rho_u(k) / n. About 0.01 where they are independent. Columns of equal length, evenly sampled; what does
/// not count is 0.
double share_outside_band(const std::vector<double>& residual, const std::vector<double>& input, int lags);

}  // namespace backlash::identification
