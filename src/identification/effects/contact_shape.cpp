// SPDX-License-Identifier: BSD-3-Clause
#include "contact_shape.h"

#include <cmath>

namespace backlash::identification {
namespace {

constexpr double kOfTeeth = 0.5;  // choice: of the deflection, a start

}  // namespace

std::vector<model::Rig> with_hertzian_teeth(const model::Rig& rig, double torque) {
  const model::ContactSpec& linear = rig.mesh.contact_spec();
  if (rig.mesh.rigid || linear.law != "linear" || !(torque > 0)) return {};
  const double stiffness = linear.values.at("stiffness"), damping = linear.values.at("damping");
  const double force = torque / rig.mesh.lever(), depth = force / stiffness;
  ParameterValues in_series, alone;
  in_series["stiffness"] = force / std::pow(kOfTeeth * depth, 1.5);
  in_series["series_stiffness"] = stiffness / (1 - kOfTeeth);
  in_series["damping"] = damping;
  alone["stiffness"] = stiffness / std::sqrt(depth);
  alone["exponent"] = 1.5;
  alone["alpha"] = damping / (1.5 * force);
  std::vector<model::Rig> all(2, rig);
  all[0].mesh.contact = model::make_contact_law("hertz_in_series", in_series);
  all[1].mesh.contact = model::make_contact_law("hunt_crossley", alone);
  return all;
}

}  // namespace backlash::identification
