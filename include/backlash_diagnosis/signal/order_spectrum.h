// SPDX-License-Identifier: BSD-3-Clause
// How often per turn a signal repeats: least-squares periodogram of unevenly spaced samples over a position.
//
// For each order n [1/rad] the share of the sum of squares of y that the best
//   y = c (A sin(n q) + B cos(n q))      q: position [rad], c: carrier
// explains. This is the periodogram of Lomb (1976, Astrophys. Space Sci. 39:447) with three additions: the
// carrier; columns that are fitted at the same time (Zechmeister and Kuerster 2009, Astron. Astrophys.
// 496:577, do so with a constant); and a highest order of each sample, because at high speed a high order
// lies beyond the band of the signal. Low orders are solved exactly. At higher orders, where waves are
// orthogonal to their neighbours and to smooth columns, the sums come from a Fourier transform over a grid of
// positions.
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
  std::vector<double> taken;  // the same as a sum of squares, by which lines are ranked
};

/// Orders from one period in the whole travel to `largest` [1/rad], at most to where a tenth of the samples
/// count, with eight lines per resolution. Empty for fewer than 16 samples, or if the position does not move.
/// `known`: orthonormal columns that are fitted at the same time, to which `value` must be orthogonal.
OrderSpectrum order_spectrum(const OrderSamples& samples, double largest, const Eigen::MatrixXd& known = {});

struct OrderPeak {
  double order = 0;  // 1/rad
  double share = 0, taken = 0;
};

/// The `count` strongest lines at or above `lowest` [1/rad], at least one resolution apart, strongest first.
/// The order of a peak between two lines is that of a parabola through three lines.
std::vector<OrderPeak> strongest_orders(const OrderSpectrum& spectrum, std::size_t count, double lowest = 0);

}  // namespace backlash::signal
