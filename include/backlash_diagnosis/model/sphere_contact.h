// SPDX-License-Identifier: BSD-3-Clause
// Hertz contact of two spheres, F = K d^(3/2): the stiffness of `power_law` and its kin with exponent 1.5,
// where bodies are taken for spheres (Yumrukcal 2013, Eqs. 2.25 to 2.27, after Goldsmith). Small
// penetrations, radius of the touching circle sqrt(R d) well below both radii. Teeth touch along a line
// instead: mesh_stiffness.h.
#pragma once

namespace backlash::model {

struct Sphere {
  double radius = 0;          // m, > 0
  double youngs_modulus = 0;  // Pa, > 0
  double poisson_ratio = 0;   // 0 to 0.5
};

/// (2.25), (2.26): K [N/m^(3/2)] = 4 / (3 pi (h1 + h2)) sqrt(R1 R2 / (R1 + R2)), hi = (1 - nui^2) / (pi Ei).
/// Throws InvalidParameter outside the ranges.
double sphere_stiffness(const Sphere& first, const Sphere& second);

/// (2.27): the radius of the sphere of that mass [kg] and density [kg/m^3], both > 0, by which a body of
/// another shape is replaced [m]. Throws InvalidParameter.
double equivalent_radius(double mass, double density);

}  // namespace backlash::model
