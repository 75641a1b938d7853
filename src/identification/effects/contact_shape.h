// SPDX-License-Identifier: BSD-3-Clause
// Another contact law for the teeth. A wrong law looks like a hardening mesh, or like play, and hides other
// missing effects.
#pragma once

#include <vector>

#include "backlash_diagnosis/model/rig.h"

namespace backlash::identification {

/// The same rig with Hertzian teeth, as stiff and damped as before under `torque` [N m] on the mesh: starts
/// for fits. Before a spring with a damper, where they find how much of the deflection is whose, and damped
/// as Hunt and Crossley have it. None where its law is not `linear`.
std::vector<model::Rig> with_hertzian_teeth(const model::Rig& rig, double torque);

}  // namespace backlash::identification
