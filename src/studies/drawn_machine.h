// SPDX-License-Identifier: BSD-3-Clause
// A machine as its rig file describes it, with values drawn within what the file knows of them.
#pragma once

#include <cstdint>
#include <vector>

#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::studies {

/// What the torque sensor makes of the torque in its spring: gain times the torque `delay` [s] ago through a
/// filter of first order, y' = (gain T - y) / time_constant.
struct SensorPath {
  double gain = 1, delay = 0, time_constant = 0;

  /// In place; the values are `interval` [s] apart and begin at rest.
  void apply(std::vector<double>& torque, double interval) const;
};

struct Machine {
  model::Rig rig;
  SensorPath sensor;
};

/// As the file says.
Machine declared_machine(const rig_file::RigFile& file);

/// Drawn from what the file knows of its values: those of diagnosis.waveform by their spreads (log-normal,
/// those that are no factor normal and not below 0, all at most three spreads off), of another rig the
/// stiffness of the couplings by diagnosis.stiffness_uncertainty. Deterministic for a seed.
Machine draw_machine(const rig_file::RigFile& file, std::uint64_t seed);

/// Drawn from diagnosis.stiffness_uncertainty alone.
Machine draw_stiffness(const rig_file::RigFile& file, std::uint64_t seed);

/// The declared machine with one of waveform_quantities() off by `spreads`, or, beyond the last, with the
/// factor that all have in common. The rig needs diagnosis.waveform.
Machine machine_off(const rig_file::RigFile& file, std::size_t quantity, double spreads);

}  // namespace backlash::studies
