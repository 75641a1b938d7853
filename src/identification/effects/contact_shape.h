// SPDX-License-Identifier: BSD-3-Clause
// Another contact law for the teeth. A wrong law looks like a hardening mesh and hides other missing effects.
#pragma once

#include <optional>

#include "backlash_diagnosis/model/rig.h"

namespace backlash::identification {

/// The same rig with Hertzian teeth, K d^1.5 (1 + 3/2 alpha d') (Hunt and Crossley 1975), as stiff and damped
/// as before under `torque` [N m] on the mesh. Nothing where its law is not `linear`.
std::optional<model::Rig> with_hertzian_teeth(const model::Rig& rig, double torque);

}  // namespace backlash::identification
