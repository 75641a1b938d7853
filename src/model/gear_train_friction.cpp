// SPDX-License-Identifier: BSD-3-Clause
// Sticking and sliding of the ends of a gear train; see StickSlip.
#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/model/gear_train.h"

namespace backlash::model {

void GearTrain::brake_motor() {
  smooth_ = false;
  braked_ = true;
  if (dry_ends_.empty() || dry_ends_.front().part != kMotor)
    dry_ends_.insert(dry_ends_.begin(), {kMotor, {}});
}

const FrictionLimits& GearTrain::limits(const DryEnd& end, const EndFriction& friction) const {
  return end.part == kMotor ? friction.motor : friction.load;
}

void GearTrain::friction_events(double t, const double* state, AppliedTorque applied, double* values) const {
  const Balance b = balance(t, state, applied);
  for (const DryEnd& end : dry_ends_) {
    const int node = layout_.node[end.part];
    *values++ = end.mode.event(b.net[node], state[layout_.dof + node], limits(end, b.friction));
  }
}

void GearTrain::begin_friction(double t, double* state, AppliedTorque applied) {
  for (DryEnd& end : dry_ends_) {
    const Balance b = balance(t, state, applied);  // anew: the end before may have been stopped
    const int node = layout_.node[end.part];
    end.mode.begin(b.net[node], state[layout_.dof + node], limits(end, b.friction), state[node]);
    end.position = state[node];
  }
}

bool GearTrain::update_friction(double t, double* state, AppliedTorque applied) {
  bool changed = false;
  for (DryEnd& end : dry_ends_) {
    const Balance b = balance(t, state, applied);
    const int node = layout_.node[end.part];
    changed |= end.mode.update(b.net[node], state[layout_.dof + node], limits(end, b.friction), state[node]);
    end.position = state[node];
  }
  return changed;
}

double GearTrain::presliding_time(double t, const double* state, AppliedTorque applied) const {
  double shortest = std::numeric_limits<double>::infinity();
  if (!presliding_) return shortest;
  const Balance b = balance(t, state, applied);
  for (const DryEnd& end : dry_ends_) {
    const FrictionLimits& friction = limits(end, b.friction);
    const double highest = friction.forward + friction.backward;  // stiffness times distance
    if (!end.mode.stuck() && friction.presliding > 0 && highest > 0)
      shortest =
          std::min(shortest, std::sqrt(inertia_[layout_.node[end.part]] * friction.presliding / highest));
  }
  return shortest;
}

void GearTrain::hold(double* state) const {
  for (const DryEnd& end : dry_ends_) {
    if (!end.mode.stuck()) continue;
    state[layout_.node[end.part]] = end.position;
    state[layout_.dof + layout_.node[end.part]] = 0;
  }
}

bool GearTrain::any_stuck() const {
  return std::any_of(dry_ends_.begin(), dry_ends_.end(), [](const DryEnd& end) { return end.mode.stuck(); });
}

}  // namespace backlash::model
