// SPDX-License-Identifier: BSD-3-Clause
// How large twice the log likelihood ratio of a change grows by chance where the onset may be any.
#pragma once

namespace backlash::changes {

/// P(largest gain over the onsets > gain), no change there: an effect with `values` values, an onset before
/// each of the last `fewest` to `most` windows, scores of windows normal and independent. Siegmund 1985,
/// "Sequential Analysis", 4.3, in `values` dimensions:
///   P(chi^2 > b^2) + b^d exp(-b^2 / 2) / (2^(d/2 - 1) Gamma(d/2)) int nu(x) / x dx,  b^2 = gain, d = values,
/// x from b / sqrt(most) to b / sqrt(fewest), nu(x) = exp(-0.583 x) as the onsets are discrete. Within 10 %
/// for probabilities below 0.1. Larger than 1 where it means nothing. Needs fewest >= 1, most >= fewest.
double chance_of_gain(double gain, double values, double fewest, double most);

/// The gain that chance exceeds with `probability`, 0 < probability < 0.5.
double gain_by_chance(double probability, double values, double fewest, double most);

}  // namespace backlash::changes
