// Sticking and sliding of one body under dry friction, without any regularisation of the friction law.
//
//   sliding  J a = net - s F_s, s = +-1 the direction, F_s > 0 the friction in that direction
//   stuck    w = 0, a = 0 while -F_- <= net <= F_+           net: all other torques on the body
//
// A body that slides comes to rest where its speed crosses zero; there and wherever the torque jumps it is
// decided anew. Infinite friction is a brake: it stops a body at once (Karnopp 1985, ASME J. Dyn. Syst. Meas.
// Control 107:100, with the zero of the speed found as an event instead of his interval of speeds).
#pragma once

#include "backlash_diagnosis/model/term.h"

namespace backlash {

class StickSlip {
 public:
  bool stuck() const { return direction_ == 0; }
  int direction() const { return direction_; }  // +1, 0, -1

  /// Friction on the body [N m] while it slides; a stuck one is held by whoever moves it.
  double torque(const FrictionLimits& limits) const {
    return direction_ == 0 ? 0 : direction_ > 0 ? -limits.forward : limits.backward;
  }

  /// A value that rises through 0 where the mode ends.
  double event(double net, double speed, const FrictionLimits& limits) const;

  /// Decides the mode from the body's speed [rad/s] and sets a speed that has just crossed zero to zero. True
  /// where mode or speed have changed.
  bool update(double net, double& speed, const FrictionLimits& limits);

  /// The mode of a body that did not come here by motion.
  void begin(double net, double& speed, const FrictionLimits& limits);

 private:
  void decide(double net, const FrictionLimits& limits);

  int direction_ = 0;
};

}  // namespace backlash
