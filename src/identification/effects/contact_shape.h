// SPDX-License-Identifier: BSD-3-Clause
// Another contact law for the teeth. A wrong law looks like a hardening mesh, or like play, and hides other
// missing effects.
#pragma once

#include <optional>

#include "backlash_diagnosis/model/rig.h"

namespace backlash::identification {

/// The same rig with Hertzian teeth before a spring, as stiff and damped as before under `torque` [N m] on
/// the mesh: a start for fits, which find how much of the deflection is whose. Nothing where its law is not
/// `linear`.
std::optional<model::Rig> with_hertzian_teeth(const model::Rig& rig, double torque);

}  // namespace backlash::identification
