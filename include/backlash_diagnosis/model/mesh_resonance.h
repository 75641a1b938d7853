// SPDX-License-Identifier: BSD-3-Clause
// The oscillation of motor against load through the teeth, which sets the time scale of a geared machine.
#pragma once

#include <vector>

#include "backlash_diagnosis/model/rig.h"

namespace backlash::model {

/// Hz: sqrt(k (1 / J_M + 1 / J_L)) / 2 pi, of a locked link sqrt(k / J_M) / 2 pi, with the stiffness k of
/// closed teeth at rest under `torque` [N m] > 0 (of a linear law the same under any). 0 for a rigid mesh.
/// `rig` is of the load side.
double mesh_resonance(const Rig& rig, double torque);

/// Hz: that of config/two_inertia_servo.yaml, on whose records the bands of fits were tried (simulation).
/// Bands of other machines are as far from their own resonance.
constexpr double kTriedResonance = 44.2425;

/// N m: root mean square, the usual torque that a mesh is under.
double usual_torque(const std::vector<double>& torque);

}  // namespace backlash::model
