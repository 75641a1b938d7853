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
// Friction with a presliding distance (Presliding) is continuous where the speed crosses zero. Such a body
// sticks only if it is at rest and its torques are in balance to a millionth of its friction.
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

  /// A value that rises through 0 at the moment when the body begins to slide or comes to rest.
  double event(double net, double speed, const FrictionLimits& limits) const;

  /// Decides the mode from the body's speed [rad/s] and sets a speed that has just crossed zero to zero. True
  /// where mode or speed have changed.
  bool update(double net, double& speed, const FrictionLimits& limits, double position = 0);

  /// Sets the mode of a body at the start of a simulation, or after its state was set. Presliding friction
  /// begins at 0.
  void begin(double net, double& speed, const FrictionLimits& limits, double position = 0);

 private:
  void decide(double net, const FrictionLimits& limits);
  bool turn(double net, double& speed, const FrictionLimits& limits, double position);

  int direction_ = 0;
  Presliding memory_;
};

}  // namespace backlash::model
