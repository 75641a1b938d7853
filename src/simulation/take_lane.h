// SPDX-License-Identifier: BSD-3-Clause
// The numbers of one rig among those of several (lanes, whose header stands before this one).
#pragma once

#include "backlash_diagnosis/model/equations_of_motion.h"
#include "power_teeth.h"

namespace backlash::simulation {

template <typename Real>
void take_lane(model::EquationsOfMotion<Real>& all, int at, const model::EquationsOfMotion<double>& one) {
  for (int part = 0; part < model::TrainParts::kPartCount; ++part) {
    set_lane(all.damping[part], at, one.damping[part]);
    set_lane(all.asymmetry[part], at, one.asymmetry[part]);
    set_lane(all.inverse_inertia[part], at, one.inverse_inertia[part]);
  }
  set_lane(all.input_stiffness, at, one.input_stiffness);
  set_lane(all.input_damping, at, one.input_damping);
  set_lane(all.output_stiffness, at, one.output_stiffness);
  set_lane(all.output_damping, at, one.output_damping);
  set_lane(all.lever, at, one.lever);
  set_lane(all.start, at, one.start);
}

/// Of the same exponent.
template <typename Real>
void take_lane(PowerTeeth<Real>& all, int at, const PowerTeeth<double>& one) {
  all.exponent = one.exponent;
  set_lane(all.stiffness, at, one.stiffness);
  set_lane(all.loss, at, one.loss);
  set_lane(all.damping, at, one.damping);
  set_lane(all.half_gap, at, one.half_gap);
}

}  // namespace backlash::simulation
