// SPDX-License-Identifier: BSD-3-Clause
// Sticking and sliding of one body under dry friction, without any regularisation of the friction law.
//
//   sliding  J a = net - s F_s, s = +-1 the direction, F_s > 0 the friction in that direction
//   stuck    w = 0, a = 0 while -F_- <= net <= F_+           net: all other torques on the body
//
// A body that slides comes to rest where its speed crosses zero. There, and where the torque jumps, the mode
// is decided again. Infinite friction is a brake: it stops a body at once (Karnopp 1985, ASME J. Dyn. Syst.
// Meas. Control 107:100, with the zero of the speed found as an event instead of his interval of speeds).
//
// Where friction has a presliding distance (Presliding) it goes on from what it is where the speed crosses
// zero. Such a body sticks only where it is at rest with all torques in balance to a millionth of its
// friction.
#pragma once

#include "backlash_diagnosis/model/presliding.h"
#include "backlash_diagnosis/model/term.h"

namespace backlash::model {

class StickSlip {
 public:
  bool stuck() const { return direction_ == 0; }
  int direction() const { return direction_; }  // +1, 0, -1

  /// Friction on the body [N m] while it slides; a stuck body is held by the caller. Here and below the
  /// position [rad] and the speed [rad/s] count only with presliding.
  double torque(const FrictionLimits& limits, double position = 0, double speed = 0) const {
    if (limits.presliding > 0) return -memory_.friction(direction_, limits, position, speed);
    return direction_ == 0 ? 0 : direction_ > 0 ? -limits.forward : limits.backward;
  }

  /// A value that rises through 0 where the mode ends.
  double event(double net, double speed, const FrictionLimits& limits) const;

  /// Decides the mode from the body's speed [rad/s] and sets a speed that has just crossed zero to zero. True
  /// where mode or speed have changed.
  bool update(double net, double& speed, const FrictionLimits& limits, double position = 0);

  /// The mode of a body that did not come here by motion. With presliding, friction begins without load.
  void begin(double net, double& speed, const FrictionLimits& limits, double position = 0);

 private:
  void decide(double net, const FrictionLimits& limits);
  bool turn(double net, double& speed, const FrictionLimits& limits, double position);

  int direction_ = 0;
  Presliding memory_;
};

}  // namespace backlash::model
