// SPDX-License-Identifier: BSD-3-Clause
// A rig file that knows its machine, for tests of what a curve says of that very machine.
#pragma once

#include <cmath>

#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::test {

/// All that diagnosis.waveform knows is known to `share` of what is known without a word in the file; of
/// stiffness what diagnosis.stiffness_uncertainty says stays.
inline rig_file::RigFile known(rig_file::RigFile file, double share) {
  if (!file.diagnosis.waveform) return file;
  diagnosis::WaveformSpread& spread = file.diagnosis.waveform->spread;
  if (std::isnan(spread.dry_friction))
    spread.dry_friction = diagnosis::WaveformSpread::kDryFriction * file.simulation.excitation.amplitude;
  for (const diagnosis::WaveformQuantity& q : diagnosis::waveform_quantities()) spread.*q.spread *= share;
  return file;
}

}  // namespace backlash::test
