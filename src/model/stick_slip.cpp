#include "backlash_diagnosis/model/stick_slip.h"

#include <algorithm>
#include <cmath>

namespace backlash {

// Zero belongs to the mode: a speed of zero is where sliding begins, and a torque of just the limit is held.
// A value of zero at a restart would hide a mode that ends at once; SUNDIALS multiplies the values at both
// ends of a step, which must not underflow.
double StickSlip::event(double net, double speed, const FrictionLimits& limits) const {
  const double value = stuck() ? std::max(net - limits.forward, -net - limits.backward) : -direction_ * speed;
  return value == 0 ? -1e-100 : value;
}

void StickSlip::decide(double net, const FrictionLimits& limits) {
  direction_ = net > limits.forward ? 1 : net < -limits.backward ? -1 : 0;
}

void StickSlip::begin(double net, double& speed, const FrictionLimits& limits) {
  direction_ = 0;
  update(net, speed, limits);
}

bool StickSlip::update(double net, double& speed, const FrictionLimits& limits) {
  const int before = direction_;
  const double speed_before = speed;
  const double against = speed > 0 ? limits.forward : limits.backward;
  if (stuck() && speed != 0 && std::isfinite(against)) {  // set in motion by an impact
    direction_ = speed > 0 ? 1 : -1;
  } else if (direction_ * speed <= 0) {
    speed = 0;
    decide(net, limits);
  }
  return direction_ != before || speed != speed_before;
}

}  // namespace backlash
