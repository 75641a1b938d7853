#include "backlash_diagnosis/model/stick_slip.h"

#include <algorithm>

namespace backlash {

double StickSlip::event(double net, double speed, const FrictionLimits& limits) const {
  if (!stuck()) return -direction_ * speed;
  return std::max(net - limits.forward, -net - limits.backward);
}

// At the limit it slides: an event found where net equals the limit would not be found again.
void StickSlip::decide(double net, const FrictionLimits& limits) {
  direction_ = net >= limits.forward ? 1 : net <= -limits.backward ? -1 : 0;
}

void StickSlip::begin(double net, double& speed, const FrictionLimits& limits) {
  direction_ = 0;
  update(net, speed, limits);
}

bool StickSlip::update(double net, double& speed, const FrictionLimits& limits) {
  const int before = direction_;
  const double speed_before = speed;
  if (stuck() && speed != 0) {  // set in motion by an impact
    direction_ = speed > 0 ? 1 : -1;
  } else if (direction_ * speed <= 0) {
    speed = 0;
    decide(net, limits);
  }
  return direction_ != before || speed != speed_before;
}

}  // namespace backlash
