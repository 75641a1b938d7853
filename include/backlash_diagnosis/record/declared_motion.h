// SPDX-License-Identifier: BSD-3-Clause
// What a rig file says that the signs, units and sizes of a record can be held against.
#pragma once

#include <functional>

namespace backlash::record {

/// A play or compliance so many times the declared is not believed: choice.
constexpr double kLooserThanDeclared = 20;

struct DeclaredMotion {
  bool known = false;          // there is a rig file; else the rest is what is most likely
  bool free_load = false;      // a load that turns with the motor, through teeth or rigidly
  bool through_teeth = false;  // with play and teeth that yield between them
  bool linear = false;         // m and N for rad and N m
  bool may_hold_load = false;  // a set of bench records, in some of which the load is held or taken off
  bool shares_stamps = false;  // with other joints: stamps stay as they are
  double axis_ratio = 1;       // of the axis of the motor's channels over the load's
  double reduction_ratio = 1;  // motor turns per load turn
  double motor_inertia = 0, load_inertia = 0;  // kg m^2 at the load side; 0: not said
  /// rad at the load side: play and twice what teeth yield under a torque of the motor [N m] there.
  std::function<double(double)> looseness;
  /// Hz: the swing of motor against load under such a torque.
  std::function<double(double)> resonance;
};

}  // namespace backlash::record
