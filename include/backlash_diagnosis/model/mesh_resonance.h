// SPDX-License-Identifier: BSD-3-Clause
// The oscillation of motor against load through the teeth, which sets the time scale of a geared machine.
#pragma once

#include <vector>

#include "backlash_diagnosis/model/rig.h"

namespace backlash::model {

/// Hz: sqrt(k (1 / J_M + 1 / J_L)) / 2 pi, of a locked link sqrt(k / J_M) / 2 pi, with the tangent stiffness
/// k of the mesh under the static `torque` [N m] > 0 (which a linear law does not depend on). 0 for a rigid
/// mesh. `rig` has its values at the load side (load_side()).
double mesh_resonance(const Rig& rig, double torque);

/// Hz: mesh resonance of config/two_inertia_servo.yaml, on whose simulated records the frequency bands of
/// fits were chosen. Bands of another machine are in the same ratio to its own resonance.
constexpr double kTriedResonance = 44.2425;

/// N m: root mean square of `torque`, taken as the typical load of the mesh.
double usual_torque(const std::vector<double>& torque);

}  // namespace backlash::model
