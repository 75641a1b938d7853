// SPDX-License-Identifier: BSD-3-Clause
#include "contact_shape.h"

#include <cmath>

namespace backlash::identification {
namespace {

constexpr double kOfTeeth = 0.5;  // choice: of the deflection, a start

}  // namespace

std::optional<model::Rig> with_hertzian_teeth(const model::Rig& rig, double torque) {
  const model::ContactSpec& linear = rig.mesh.contact_spec();
  if (rig.mesh.rigid || linear.law != "linear" || !(torque > 0)) return std::nullopt;
  const double stiffness = linear.values.at("stiffness"), damping = linear.values.at("damping");
  const double force = torque / rig.mesh.lever(), depth = force / stiffness;
  ParameterValues values;
  values["stiffness"] = force / std::pow(kOfTeeth * depth, 1.5);
  values["series_stiffness"] = stiffness / (1 - kOfTeeth);
  values["damping"] = damping;
  model::Rig other = rig;
  other.mesh.contact = model::make_contact_law("hertz_in_series", values);
  return other;
}

}  // namespace backlash::identification
