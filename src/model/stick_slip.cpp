// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/stick_slip.h"

#include <algorithm>
#include <cmath>

namespace backlash::model {
namespace {

// With presliding a body would swing for ever, in the end by roundings. At rest are speeds far below any that
// is computed; the torque moves a body that is held by it by less than this part of the presliding distance.
constexpr double kRestingSpeed = 1e-12;  // rad/s

double resting_torque(const FrictionLimits& limits) {
  return 1e-6 * (limits.forward + limits.backward);
}

}  // namespace

// Zero belongs to the mode: a speed of zero is where sliding begins, and a torque of just the limit is held.
// A value of zero at a restart would hide a mode that ends at once; SUNDIALS multiplies the values at both
// ends of a step, which must not underflow.
double StickSlip::event(double net, double speed, const FrictionLimits& limits) const {
  if (limits.presliding > 0) {
    const double back = stuck() ? std::fabs(net - memory_.friction(0, limits, 0)) - 2 * resting_torque(limits)
                                : -direction_ * speed;
    return back > 0 ? std::max(back, 1e-100) : std::min(back, -1e-100);
  }
  const double value = stuck() ? std::max(net - limits.forward, -net - limits.backward) : -direction_ * speed;
  return value == 0 ? -1e-100 : value;
}

void StickSlip::decide(double net, const FrictionLimits& limits) {
  direction_ = net > limits.forward ? 1 : net < -limits.backward ? -1 : 0;
}

void StickSlip::begin(double net, double& speed, const FrictionLimits& limits, double position) {
  direction_ = 0;
  memory_ = Presliding(position);
  update(net, speed, limits, position);
}

/// Where it turns the speed stays as it is, just beyond zero: friction, and with it the acceleration, does
/// not jump there.
bool StickSlip::turn(double net, double& speed, const FrictionLimits& limits, double position) {
  if (direction_ * speed > 0) return false;
  const double friction = memory_.friction(direction_, limits, position), pull = net - friction;
  const int before = direction_;
  const double speed_before = speed;
  if (std::fabs(speed) > kRestingSpeed) {
    direction_ = speed > 0 ? 1 : -1;
  } else {
    const bool rests = std::fabs(pull) <= (stuck() ? 2 : 1) * resting_torque(limits);
    direction_ = rests ? 0 : pull > 0 ? 1 : -1;
    if (direction_ * speed <= 0) speed = 0;
  }
  if (direction_ != before) memory_ = Presliding(position, friction);
  return direction_ != before || speed != speed_before;
}

bool StickSlip::update(double net, double& speed, const FrictionLimits& limits, double position) {
  if (limits.presliding > 0) return turn(net, speed, limits, position);
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

}  // namespace backlash::model
