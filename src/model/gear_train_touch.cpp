// SPDX-License-Identifier: BSD-3-Clause
// Touches of teeth whose law depends on how a contact began.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/restitution.h"

namespace backlash::model {

double GearTrain::penetration(const PartMotion& s, Flank flank) const {
  return flank * gap_position(s) - half_gap_ - lever_ * shift(s, flank, 0).opening;
}

double GearTrain::approach(const PartMotion& s, Flank flank) const {
  const FlankShift at = shift(s, flank, 0);
  return flank * equations_.gap_rate(s) -
         lever_ * (at.motor_slope * s.w[kPinion] + at.load_slope * s.w[kGear]);
}

void GearTrain::enter(Flank flank) {
  flank_ = flank;
  acting_gap_ = flank == kApart ? std::numeric_limits<double>::infinity() : half_gap_;
}

// Closing of either flank; then the parting of a contact or, between contacts, the turning points of the
// motion: a flank that closes and opens within one step of the integrator is found there. A speed of exactly
// zero, which may last, is no turning point.
void GearTrain::contact_events(const double* state, double* values) const {
  const PartMotion s = part_motion(state);
  values[0] = penetration(s, kForward);
  values[1] = penetration(s, kReverse);
  const double no_turn = -std::numeric_limits<double>::min();
  const auto parting = [&](Flank flank) {
    const double rate = approach(s, flank);
    return rate == 0 ? no_turn : -rate;
  };
  values[2] = flank_ != kApart ? -penetration(s, flank_) : parting(kReverse);
  values[3] = flank_ != kApart ? no_turn : parting(kForward);
}

void GearTrain::begin_contact(double* state) {
  const PartMotion s = part_motion(state);
  const double farthest =
      std::max({lever_ * std::fabs(s.q[kPinion]), lever_ * std::fabs(s.q[kGear]), half_gap_});
  const double rounding = 4 * std::numeric_limits<double>::epsilon() * farthest;
  impact_speed_ = 0;
  enter(kApart);
  for (Flank flank : {kForward, kReverse}) {
    const double depth = penetration(s, flank), rate = approach(s, flank);
    if (rate > 0 && std::fabs(depth) <= rounding) return touch(flank, state);
    if (depth > rounding || (rate == 0 && depth >= 0)) return enter(flank);
  }
}

bool GearTrain::update_contact(double* state) {
  const PartMotion s = part_motion(state);
  bool changed = false;
  if (flank_ != kApart && penetration(s, flank_) <= 0) {
    enter(kApart);
    changed = true;
  }
  for (Flank flank : {kForward, kReverse}) {
    const double depth = penetration(s, flank);
    if (depth > 0 || (depth == 0 && approach(s, flank) >= 0)) {
      touch(flank, state);
      return true;
    }
    changed |=
        depth == 0;  // on its way out; SUNDIALS does not go on from a zero that it cannot leave at once
  }
  return changed;
}

void GearTrain::touch(Flank flank, double* state) {
  const PartMotion s = part_motion(state);
  impact_speed_ = std::max(0.0, approach(s, flank));
  enter(flank);
  const std::optional<double> restitution = contact_->jump_restitution(impact_speed_);
  // without play there is no room to bounce
  if (!restitution || half_gap_ == 0 || penetration(s, flank == kForward ? kReverse : kForward) >= 0) return;
  const int pinion = layout_.node[kPinion], gear = layout_.node[kGear];
  const FlankShift at = shift(s, flank, 0);
  const double to_pinion = lever_ * (flank - at.motor_slope), to_gear = lever_ * (flank + at.load_slope);
  const double wall = std::numeric_limits<double>::infinity();
  const bool held = braked_ && pinion == layout_.node[kMotor];
  if (held && gear == TrainLayout::kFixed) return;
  const ImpactSpeeds after =
      speeds_after_impact(held ? wall : inertia_[pinion] / (to_pinion * to_pinion),
                          gear == TrainLayout::kFixed ? wall : inertia_[gear] / (to_gear * to_gear),
                          {to_pinion * s.w[kPinion], to_gear * s.w[kGear]}, *restitution);
  if (!held) state[layout_.dof + pinion] = after.first / to_pinion;
  if (gear != TrainLayout::kFixed) state[layout_.dof + gear] = after.second / to_gear;
  if (contact_->jump_restitution(*restitution * impact_speed_)) enter(kApart);  // else too slow to leave
}

}  // namespace backlash::model
