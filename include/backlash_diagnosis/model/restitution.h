// SPDX-License-Identifier: BSD-3-Clause
// Restitution of impacts whose damping is proportional to the elastic force, and the published
// approximations.
//
// Two bodies of reduced mass m meet at speed v [m/s] with F = K d^n (1 + D d'/v), D >= 0 [-]. They part at
// e v, and
//   D (1 + e) = ln((1 + D) / (1 - e D))                                                              (exact)
// whatever m, K and n are, because m d' dd' = -F dd is separable, and compression (d' from v to 0) and
// restitution (d' from 0 to -e v) have the same largest depth (for the force of Sarkar, Ellis and Moore 1997,
// Section 4.2). 0 < e <= 1; e = 1 for D = 0, e < 1 / D, e -> 0 as D grows.
#pragma once

namespace backlash::model {

/// e that follows from D >= 0 by the exact relation. Throws InvalidParameter for another D.
double restitution_of_damping(double damping);

/// e of an impact at speed v by the law of Hunt and Crossley (contact/hunt_crossley.cpp), whose damping is
/// D = 3/2 alpha v; `alpha_speed` = alpha v >= 0 [-]. Throws InvalidParameter for another.
double hunt_crossley_restitution(double alpha_speed);

/// D that gives 0 < e <= 1 by the exact relation, to rounding. Below e = 0.03 it is 1 / e to double
/// precision. Throws InvalidParameter outside the range.
double damping_of_restitution(double restitution);

/// Published approximations of D for a wanted e in [0, 1] (the last two: e > 0). They meet e only near 1: for
/// e = 0.5 in this order 0.663, 0.594, 0.725, 0.799, 0.488, 0.470 come out.
double hunt_crossley_damping(double restitution);  // 3/2 (1 - e), Hunt and Crossley (1975)
double yang_sun_damping(double restitution);  // 6 (1 - e) / ((2e - 1)^2 + 3), Sarkar et al. (1997), Eq. 13
double lankarani_nikravesh_damping(double restitution);  // 3/4 (1 - e^2), Lankarani and Nikravesh (1990)
double lee_wang_damping(double restitution);             // 3/4 (1 - e), Lee and Wang (1983)
double gonthier_damping(double restitution);             // (1 - e^2) / e, Gonthier et al. (2004)
double flores_damping(double restitution);               // 8/5 (1 - e) / e, Flores et al. (2011)

/// Damping that acts on approach only (Jankowski 2005): F = K d^(3/2) + 2 xi sqrt(K m sqrt(d)) d' while
/// d' > 0, and F = K d^(3/2) after. The damping ratio xi [-] for a wanted e in (0, 1], two approximations:
///   sqrt(5) / (2 pi) (1 - e^2) / e        Yumrukcal (2013), Eq. 2.23 with its lost factor; within 0.08 of e
///   9 sqrt(5) / 2 (1 - e^2) / (e (e (9 pi - 16) + 16))                          Eq. 2.24; within 0.009 of e
double jankowski_first_damping_ratio(double restitution);
double jankowski_damping_ratio(double restitution);

/// e that this force really gives for xi >= 0, independent of speed, K and m: with s = 4/5 d^(5/4) the
/// approach is that of a linear oscillator of damping ratio z = 2 xi / sqrt(5), and
///   e = exp(-z acos(z) / sqrt(1 - z^2)), for z > 1 exp(-z acosh(z) / sqrt(z^2 - 1)).
double jankowski_restitution(double damping_ratio);

/// Rigid bodies, before and after an impact along one line: positions 1 < 2, they meet where v1 > v2 [m/s].
struct ImpactSpeeds {
  double first, second;
};

/// Stereomechanical impact: (v1' - v2') = -e (v1 - v2) with momentum conserved (Yumrukcal 2013, Eqs. 2.15
/// and 2.16, whose printed sign in the latter is corrected). Masses > 0 [kg], infinite for a wall.
ImpactSpeeds speeds_after_impact(double mass1, double mass2, ImpactSpeeds before, double restitution);

}  // namespace backlash::model
