// SPDX-License-Identifier: BSD-3-Clause
// Stiffness of a pair of spur gears along the mesh cycle: pairs of teeth come into and leave contact, and
// each is softer near its tip than in the middle of its life.
//
// A pair of teeth touches while it travels the length of contact, that is for contact_ratio base pitches; new
// pairs come one base pitch apart. With 0 <= u < contact_ratio the travel of one pair since its first touch
// [base pitches],
//
//   k(phase) = sum over the pairs u = phase, phase + 1, ... of k_pair(u)     [N/m], phase in base pitches
//
// Laws of k_pair:
//
// step: K = pi E L / (4 (1 - nu^2)), constant while the pair touches. Hertz contact of two cylinders alone,
// linearised by Yang and Sun (1985); one pair K, two pairs 2 K: Sarkar, Ellis and Moore (1997), Sections 3.2
// and 4.1. Tooth bending is left out, which makes it some ten times too stiff.
//
// lin_parker: kmax (-1.8 t^2 + 1.8 t + 0.55), t = u / contact_ratio: Yumrukcal (2013), Eqs. 2.30 and 2.31,
// after Lin and Parker; mean of a pair 0.85 kmax. kmax is the single stiffness c' of ISO 6336-1, method B
// (solid blanks, basic rack 1/1.25, 0.8 of the theoretical value, times E / 206 GPa): profile shifts -0.5 to
// 2 in sum, not less at the smaller gear.
//
// hertz_bending: L / k_pair = 1/k1'(r1) + 1/k2'(r2) + 1/kh'. Hertz contact kh' = K / L in series with the
// bending of both teeth, loaded at the radii r1 and r2, by a polynomial in teeth and shift: Yumrukcal (2013),
// Eqs. 2.28 and 2.29, after Kuang and Yang (1992). Steel only (E from 180 to 220 GPa), 12 to 100 teeth, shift
// -0.6 to 0.6.
//
// Contact ratios below 1, down to 0.9: no pair touches for the rest of the cycle, and k is 0.
//
// All laws are linear: the stiffness does not depend on the load. Extended contact under load is left out;
// the `transition` stands for it, see below.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/gear_geometry.h"

namespace backlash::model {

struct MeshStiffnessSettings {
  std::string law;            // one of mesh_stiffness_laws()
  double face_width = 0;      // m, > 0; stiffness is proportional to it
  double youngs_modulus = 0;  // Pa, > 0, of both gears
  double poisson_ratio = 0;   // 0 to 0.5, of both gears
  /// Travel over which a pair takes up or gives off its load, in base pitches, 0 to 0.5, centred on the first
  /// and last touch of rigid teeth (cubic, continuous first derivative). 0: at once; an integrator notices
  /// that jump of the stiffness only by its error control.
  double transition = 0;
};

/// step, lin_parker, hertz_bending
const std::vector<std::string>& mesh_stiffness_laws();

/// Hertz contact of two cylinders of the same material, linearised, per face width [Pa = N/m per m]:
/// pi E / (4 (1 - nu^2)).
double hertz_stiffness(double youngs_modulus, double poisson_ratio);

/// Bending stiffness of one steel tooth loaded at `radius` [m], per face width [Pa]. Throws InvalidParameter
/// outside the range of the polynomial.
double bending_stiffness(const SpurGear& gear, double module, double radius);

class MeshStiffness {
 public:
  /// Throws InvalidParameter: what gear_geometry() refuses, a pair with faults, values outside the ranges
  /// above.
  MeshStiffness(const GearPair& pair, const MeshStiffnessSettings& settings);

  /// N/m at a phase [base pitches] counted from the first touch of a pair, the pinion driving; any finite
  /// phase.
  double stiffness(double phase) const;

  /// Pairs of rigid teeth in contact there.
  int pairs(double phase) const;

  /// N/m of one pair `travel` base pitches after its first touch, 0 where it does not touch, and its slope
  /// [N/m per base pitch]. The slope needs a transition > 0: without one the stiffness jumps.
  double of_pair(double travel) const;
  double slope_of_pair(double travel) const;

  double mean() const { return mean_; }  // N/m, over a cycle
  double transition() const { return transition_; }
  int pinion_teeth() const { return pinion_teeth_; }
  int gear_teeth() const { return gear_teeth_; }
  const GearGeometry& geometry() const { return geometry_; }

 private:
  GearGeometry geometry_;
  int pinion_teeth_, gear_teeth_;
  double transition_;
  std::function<double(double life)> pair_stiffness_;  // N/m; life 0 at the first touch, 1 at the last
  double mean_;
};

}  // namespace backlash::model
