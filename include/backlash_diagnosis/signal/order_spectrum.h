// SPDX-License-Identifier: BSD-3-Clause
// How often per turn a signal repeats: least-squares periodogram of unevenly spaced samples over a position.
//
// For each order n [1/rad] the share of the sum of squares of y that the best
//   y = c (A sin(n q) + B cos(n q))      q: position [rad], c: carrier
// takes away: Lomb (1976, Astrophys. Space Sci. 39:447) with a carrier, with columns that are fitted as well
// (Zechmeister and Kuerster 2009, Astron. Astrophys. 496:577 do that with a constant) and with samples that
// count only up to an order of their own, since a machine that moves fast passes high orders beyond the band.
// Low orders are solved exactly. Above, where waves are orthogonal to their neighbours and to smooth columns,
// the sums come from a Fourier transform over a grid of positions.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace backlash::signal {

struct OrderSamples {
  std::vector<double> value;
  std::vector<double> position;  // rad
  std::vector<double> carrier;   // 0: the sample does not count
  std::vector<double> highest;   // 1/rad, the order up to which the sample counts
};

/// Line k is at `first + k * step` [1/rad].
struct OrderSpectrum {
  double resolution = 0;  // 1/rad: 2 pi over the travel of the samples that count
  double first = 0, step = 0;
  std::vector<double> share;  // 0 to 1, of the sum of squares of the values that count at that order
  std::vector<double> taken;  // the same in squares of the value: what line is strongest
};

/// Orders from one period in the travel to `largest`, or as far as a tenth of the samples count, eight lines
/// per resolution. Empty where there are too few samples (16), or they do not move. `known`: orthonormal
/// columns over the samples that are fitted as well (no columns: none); `value` is orthogonal to them.
OrderSpectrum order_spectrum(const OrderSamples& samples, double largest, const Eigen::MatrixXd& known = {});

struct OrderPeak {
  double order = 0;  // 1/rad
  double share = 0, taken = 0;
};

/// The strongest lines, at least a resolution apart, strongest first; between lines by a parabola. Those
/// below `lowest` are left out.
std::vector<OrderPeak> strongest_orders(const OrderSpectrum& spectrum, std::size_t count, double lowest = 0);

}  // namespace backlash::signal
