// SPDX-License-Identifier: BSD-3-Clause
// Contacts of an arm that holds its pose: a torque from outside changes what the drives must give, while
// nothing moves.
//
// A joint at rest has friction of any size up to break-away in its hands: its torque creeps, and after a
// contact it stays where friction holds it. So a contact is where the torque leaves the level of the last
// quiet second by more than noise and stays active; it ends where the torque is quiet again, at whatever
// level.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/arm/motion.h"

namespace backlash::arm {

struct PushSettings {
  double quiet = 1;    // s, at the start, from which the noise is estimated; choice
  double onset = 8;    // deviations of noise from the quiet level; theory: by chance once in 10^15 samples
  double samples = 5;  // whose mean is looked at; choice
  double active =
      4;  // deviations: half the range within `window` above which the torque is not at rest; choice
  double window = 0.5;  // s; choice: hands are slower than noise
  double between = 1;   // s at rest that end a contact; choice
  double within = 2;    // deviations: where it has not begun for sure. Theory: of 20 samples one is beyond
  double rest = 0.1;  // rad/s: a faster joint moves by command; choice: pushed joints of the record give 0.02
};

struct PushEvent {
  std::size_t joint = 0;
  double begin = 0, end = 0;  // s of the record; end: where it is released
  double earliest = 0;        // s, where it was last within the noise
  double clear = 0;           // deviations of noise at the begin
  bool released = true;       // else the record ends in it
  double torque = 0;  // N m, the farthest from the level before; the drive's, so the push has the other sign
  double torque_error =
      0;  // N m: noise, the torque constant, and friction at rest, which no torque of a drive at rest shows
  double left = 0;  // N m, the level after less that before: what creep and friction keep
};

/// Of all joints that hold still, in the order of their begin, the clearest of one sample first. `constant` N
/// m per unit of the signal.
std::vector<PushEvent> pushes(const ArmRecord& record, const ArmRig& rig, const PushSettings& settings = {});

/// Whether all joints hold still (slower than `rest`) for the whole record.
bool holds_pose(const ArmRecord& record, const PushSettings& settings = {});

}  // namespace backlash::arm
