// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/fitted_rig.h"

#include "backlash_diagnosis/identification/procedures/gap_terms.h"
#include "rig_file/rig_text.h"

namespace backlash {
namespace {

void write_one_inertia(RigText& text, const Identification& found, double ratio) {
  const FittedMachine fitted{found.rig, found.parameters, found.units};
  const Body& motor = found.rig.motor;
  text.set("gear_train.motor.inertia", motor.inertia / (ratio * ratio),
           fitted.comment("inertia", ratio * ratio));
  text.set_directional("motor", "viscous_damping", motor.viscous_damping / (ratio * ratio), 0,
                       fitted.comment("viscous", ratio * ratio));
  text.set_directional("motor", "coulomb_friction", motor.coulomb_friction / ratio,
                       motor.coulomb_asymmetry / ratio, fitted.comment("coulomb", ratio));
}

}  // namespace

std::string fitted_rig_text(const RigFile& declared, const Identification& found) {
  RigText text(declared);
  const double ratio = declared.rig.motor_axis_ratio();
  if (declared.rig.mesh.rigid)
    write_one_inertia(text, found, ratio);
  else
    write_servo(text, {found.rig, found.parameters, found.units}, ratio);
  std::string fitted = text.text();
  if (found.gap_map && gap_varies(declared.rig))
    fitted = with_gap_terms(fitted, declared.source, *found.gap_map,
                            found.rig.mesh.backlash / found.rig.mesh.lever());
  rig_file_from_text(fitted, declared.source);  // what is written can be read
  return fitted;
}

}  // namespace backlash
