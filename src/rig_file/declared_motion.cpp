// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/declared_motion.h"

#include "backlash_diagnosis/model/mesh_resonance.h"
#include "backlash_diagnosis/simulation/driven_load.h"

namespace backlash::rig_file {

record::DeclaredMotion declared_motion(const model::Rig& declared) {
  const model::Rig rig = model::load_side(declared);
  record::DeclaredMotion motion;
  motion.known = true;
  motion.through_teeth = simulation::load_moves_freely(rig);
  motion.free_load = motion.through_teeth || rig.mesh.rigid;
  motion.linear = rig.linear;
  motion.axis_ratio = declared.motor_axis_ratio();
  motion.reduction_ratio = declared.reduction_ratio;
  motion.motor_inertia = rig.motor.inertia;
  motion.load_inertia = rig.link.inertia;
  if (!motion.through_teeth) return motion;
  motion.looseness = [rig](double torque) {
    const double force = torque / rig.mesh.lever();
    return (rig.mesh.backlash + (force > 0 ? 2 * rig.mesh.contact->static_penetration(force) : 0)) /
           rig.mesh.lever();
  };
  motion.resonance = [rig](double torque) { return model::mesh_resonance(rig, torque); };
  return motion;
}

}  // namespace backlash::rig_file
