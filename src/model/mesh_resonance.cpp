// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/mesh_resonance.h"

#include <cmath>

#include "backlash_diagnosis/model/gear_train.h"

namespace backlash::model {
namespace {

constexpr double kSecant = 0.01;  // theory: relative change of the force over which the stiffness is taken

}  // namespace

double mesh_resonance(const Rig& rig, double torque) {
  if (rig.mesh.rigid || !(torque > 0)) return 0;
  const GearTrain train(rig);
  const double lever = rig.mesh.lever(), force = torque / lever;
  const double deeper = rig.mesh.contact->static_penetration((1 + kSecant) * force) -
                        rig.mesh.contact->static_penetration(force);
  if (!(deeper > 0)) return 0;
  const double stiffness = kSecant * force / deeper * lever * lever;
  const double mobility = 1 / train.motor_inertia() + (rig.link_locked ? 0 : 1 / train.load_inertia());
  return std::sqrt(stiffness * mobility) / (2 * M_PI);
}

double usual_torque(const std::vector<double>& torque) {
  double square = 0;
  for (const double t : torque) square += t * t / double(torque.size());
  return std::sqrt(square);
}

}  // namespace backlash::model
