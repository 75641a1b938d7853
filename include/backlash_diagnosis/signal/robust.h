// SPDX-License-Identifier: BSD-3-Clause
// Robust statistics: a minority of wrong values has little influence.
#pragma once

#include <cstddef>
#include <vector>

namespace backlash::signal {

/// Location and scale of values of which a minority may be wrong.
struct RobustScale {
  double centre = 0;     ///< median
  double deviation = 0;  ///< standard deviation about the median, residuals clipped at `clip`
  double clip =
      0;  ///< 3.5 times the median absolute deviation scaled to a normal standard deviation, plus floor
  std::size_t outliers = 0;  ///< values farther than `clip` from the median
};

/// `floor` [unit of the values, >= 0]: a value that differs from the median by less is never an outlier.
RobustScale robust_scale(const std::vector<double>& values, double floor);

}  // namespace backlash::signal
