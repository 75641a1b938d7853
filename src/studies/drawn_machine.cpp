// SPDX-License-Identifier: BSD-3-Clause
#include "drawn_machine.h"

#include <algorithm>

#include "backlash_diagnosis/base/random.h"

namespace backlash::studies {

model::Rig draw_machine(const rig_file::RigFile& file, std::uint64_t seed) {
  model::Rig rig = file.rig;
  Random random(seed);
  for (model::Coupling* coupling : {&rig.input_coupling, &rig.output_coupling})
    coupling->stiffness *= 1 + file.diagnosis.stiffness_uncertainty * std::clamp(random.normal(), -3.0, 3.0);
  return rig;
}

}  // namespace backlash::studies
