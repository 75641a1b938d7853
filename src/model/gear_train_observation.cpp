// SPDX-License-Identifier: BSD-3-Clause
// What can be seen of a gear train in a state: its sensors, its energy, and what damping takes from it.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/model/gear_train.h"

namespace backlash::model {

Observation GearTrain::observe(const double* state, AppliedTorque applied, double t) const {
  const PartMotion s = part_motion(state);
  const double none = std::nan("");
  Observation o;
  o.motor_torque = applied.motor;
  o.motor_position = s.q[kMotor] * ratio_;
  o.motor_velocity = s.w[kMotor] * ratio_;
  const double twist = s.q[kMotor] - s.q[kPinion], twist_rate = s.w[kMotor] - s.w[kPinion];
  o.sensor_torque = layout_.input_gives
                        ? (equations_.input_stiffness * twist + sensed_damping_ * twist_rate) / ratio_
                        : none;
  o.sensor_twist = layout_.input_gives ? twist * ratio_ : none;
  o.sensor_twist_rate = layout_.input_gives ? twist_rate * ratio_ : none;
  o.load_position = load_gain_ * s.q[load_end_];
  o.load_velocity = load_gain_ * s.w[load_end_];
  o.output_torque = layout_.output_gives ? equations_.output_stiffness * (s.q[kGear] - s.q[kLink]) : none;
  o.motor_current = applied.motor / torque_constant_;
  double rate[kMaxStates];
  derivative(t, state, applied, rate);
  const double* const acceleration = rate + layout_.dof;
  o.acceleration =
      moves(kGear) ? acceleration[layout_.node[kGear]] : acceleration[layout_.node[kPinion]] * ratio_;
  return o;
}

double GearTrain::energy(const double* state) const {
  const PartMotion s = part_motion(state);
  PartMotion resting = s;
  std::fill(resting.w, resting.w + kPartCount, 0.0);
  double energy = 0;
  for (int node = 0; node < layout_.dof; ++node)
    energy += 0.5 * inertia_[node] * state[layout_.dof + node] * state[layout_.dof + node];
  if (layout_.input_gives)
    energy += 0.5 * equations_.input_stiffness * std::pow(s.q[kMotor] - s.q[kPinion], 2);
  if (layout_.output_gives)
    energy += 0.5 * equations_.output_stiffness * std::pow(s.q[kGear] - s.q[kLink], 2);
  if (!contact_) return energy;
  for (const int side : {1, -1}) {
    FlankShift at;
    if (shaped_) shaped_force(resting, side, at);
    const double penetration = side * gap_position(s) - half_gap_ - lever_ * at.opening;
    if (pairs_)
      energy += pairs_->elastic_energy(place_of(resting, side, penetration, 0), *contact_);
    else if (penetration > 0)
      energy += contact_->elastic_energy(penetration) *
                (variation_ ? variation_->factor(lever_ * s.q[kPinion], side) : 1);
  }
  return energy;
}

double GearTrain::damping_power(const double* state) const {
  const PartMotion s = part_motion(state);
  const EquationsOfMotion<double>& e = equations_;
  double power = 0;
  for (int part = 0; part < kPartCount; ++part)
    power += (e.damping[part] * s.w[part] + e.asymmetry[part] * std::fabs(s.w[part])) * s.w[part];
  if (layout_.input_gives) power += e.input_damping * std::pow(s.w[kMotor] - s.w[kPinion], 2);
  if (layout_.output_gives) power += e.output_damping * std::pow(s.w[kGear] - s.w[kLink], 2);
  return power;
}

double GearTrain::elastic_deflection(double motor_torque) const {
  const double torque = std::fabs(motor_torque) * ratio_;
  double angle = contact_ ? contact_->static_penetration(torque / lever_) / lever_ : 0;
  if (layout_.input_gives) angle += torque / equations_.input_stiffness;
  if (layout_.output_gives && load_end_ == kLink) angle += torque / equations_.output_stiffness;
  return std::copysign(angle * ratio_, motor_torque);
}

}  // namespace backlash::model
