// SPDX-License-Identifier: BSD-3-Clause
// Gear pairs that several tests share.
#pragma once

#include <cmath>

#include "backlash_diagnosis/model/gear_geometry.h"

namespace backlash::test {

/// Unshifted gears with an addendum of one module.
inline model::GearPair gear_pair(int pinion_teeth, int gear_teeth, double module,
                                 double pressure_angle_deg = 20) {
  model::GearPair pair;
  pair.pinion.teeth = pinion_teeth;
  pair.gear.teeth = gear_teeth;
  pair.module = module;
  pair.pressure_angle = pressure_angle_deg * M_PI / 180;
  return pair;
}

/// Table 2 of Sarkar, Ellis and Moore (1997): 40 and 40 teeth, pitch diameter 31.75 mm, 20 deg.
inline model::GearPair sarkar_gears(double centre_distance_change = 0) {
  model::GearPair pair = gear_pair(40, 40, 0.79375e-3);
  pair.centre_distance_change = centre_distance_change;
  return pair;
}

}  // namespace backlash::test
