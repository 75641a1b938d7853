// SPDX-License-Identifier: BSD-3-Clause
#include "drawn_machine.h"

#include <algorithm>

#include "backlash_diagnosis/base/random.h"

namespace backlash {

Rig draw_machine(const RigFile& file, std::uint64_t seed) {
  Rig rig = file.rig;
  Random random(seed);
  for (Coupling* coupling : {&rig.input_coupling, &rig.output_coupling})
    coupling->stiffness *= 1 + file.diagnosis.stiffness_uncertainty * std::clamp(random.normal(), -3.0, 3.0);
  return rig;
}

}  // namespace backlash
