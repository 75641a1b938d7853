// SPDX-License-Identifier: BSD-3-Clause
// Motion of one joint as a finite Fourier series, the usual excitation of arms (Swevers et al. 1997, IEEE
// T-RA 13:730), with a way from rest to its begin:
//   q(t) = offset + sum_k a_k cos(k w s) + b_k sin(k w s),   s = t - approach >= 0, w = 2 pi / period, k = 1
//   ... q(t) = start + (q(approach) - start) (10 x^3 - 15 x^4 + 6 x^5),   x = t / approach < 1
// Speed and acceleration are 0 where a period begins: sum k b_k = 0, sum k^2 a_k = 0.
#pragma once

#include <vector>

namespace backlash::simulation {

struct FourierMotion {
  double start = 0;                    // rad, at t = 0, at rest
  double approach = 0;                 // s, >= 0
  double period = 0;                   // s, > 0
  double offset = 0;                   // rad
  std::vector<double> cosines, sines;  // a_k, b_k [rad], as many of both
};

struct Kinematics {
  double position = 0, velocity = 0, acceleration = 0;  // rad, rad/s, rad/s^2
};

/// At t [s] >= 0; the periods follow each other without end.
Kinematics kinematics(const FourierMotion& motion, double t);

/// Throws InvalidParameter: a number that is not finite, a period that is not > 0, an approach < 0, other
/// counts of a_k and b_k, a period that does not begin at rest (beyond rounding).
void check(const FourierMotion& motion);

}  // namespace backlash::simulation
