// SPDX-License-Identifier: BSD-3-Clause
// Geometry of a pair of external involute spur gears: how the teeth meet and how much play they have.
//
// Standard involute theory; base pitch, contact ratio and operating pressure angle as in Sarkar, Ellis and
// Moore (1997), Eqs. 6 to 8, the small-change forms of the backlash as in Yumrukcal (2013), Eqs. A.2 and A.3.
// No tip relief, no rounding of tips, no deflection under load.
#pragma once

#include <string>
#include <vector>

namespace backlash::model {

/// inv(a) = tan(a) - a [rad] for 0 <= a < pi/2; the absolute error is that of doubles near a.
double involute(double angle);

/// The angle [rad] with inv(angle) = value, for finite value >= 0. Throws InvalidParameter for another value.
double inverse_involute(double value);

/// Lengths in modules are dimensionless factors of the module.
struct SpurGear {
  int teeth = 0;
  double addendum = 1;       // modules, tip circle above the reference circle without profile shift; 0.1 to 2
  double profile_shift = 0;  // modules, > 0 outwards; -1 to 1.5
  double thinning = 0;       // m, by which a tooth is too thin, along the reference circle
};

struct GearPair {
  SpurGear pinion, gear;
  double module = 0;                  // m, > 0
  double pressure_angle = 0;          // rad, of the basic rack, 5 to 45 deg
  double centre_distance_change = 0;  // m, from where unthinned teeth mesh without play
};

/// One gear of a pair, m.
struct GearCircles {
  double reference_radius, base_radius, tip_radius, operating_radius;
  double operating_tooth_thickness;  // along the operating pitch circle
  double tip_thickness;              // along the tip circle
};

struct GearGeometry {
  GearCircles pinion, gear;
  double base_pitch;                              // m, pb = 2 pi Rb / N
  double tight_centre_distance, centre_distance;  // m; tight: unthinned teeth without play
  double operating_pressure_angle;                // rad, cos = (Rb1 + Rb2) / C
  double approach, recess;  // m along the line of action before and after the pitch point, the pinion driving
  double length_of_contact;      // m, La = approach + recess
  double contact_ratio;          // La / pb
  double backlash;               // m, full free play along the line of action
  double pitch_circle_backlash;  // m, the same along the operating pitch circle
  /// What is wrong with the pair, in words; empty where it runs: contact ratio below 1, tips beyond the
  /// involute of the mate (interference), pointed teeth. Then no length of contact above holds for real
  /// teeth.
  std::vector<std::string> faults;
  /// Remarks for whoever makes the gears: teeth that a rack as deep as the mate would undercut.
  std::vector<std::string> remarks;

  double pinion_backlash_angle() const { return backlash / pinion.base_radius; }  // rad, the gear held
  double gear_backlash_angle() const { return backlash / gear.base_radius; }      // rad, the pinion held
};

/// Throws InvalidParameter for values outside the ranges above, fewer than 3 teeth, a centre distance at
/// which the base circles touch, and teeth that would jam (backlash < 0).
GearGeometry gear_geometry(const GearPair& pair);

/// The centre-distance change [m] at which the pair, with its thinning, has this backlash along the line of
/// action [m, >= 0]: the exact inverse of gear_geometry(); negative where thinning alone gives more. Ignores
/// the change in `pair`. Throws InvalidParameter.
double centre_distance_change_for(GearPair pair, double backlash);

}  // namespace backlash::model
