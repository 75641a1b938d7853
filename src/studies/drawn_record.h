// SPDX-License-Identifier: BSD-3-Clause
// Simulated records of known backlash, as a recorder gives them that was switched on at some moment, with
// noise.
#pragma once

#include <cstdint>

#include "drawn_machine.h"

namespace backlash::studies {

/// A record before it is simulated.
struct Draw {
  double backlash, noise, start;  // m, of the signal's rms, s
  int periods;                    // after settling
  std::uint64_t seed;             // of the machine and the noise
};

/// A machine of a rig file with a backlash [m]: exact motion for `duration` [s], several times finer than the
/// sampling, so that a recorder can begin between two samples.
record::Record simulate_fine(rig_file::RigFile file, Machine machine, double backlash, double duration);

/// What the rig's sensors give of a fine record from d.start on: settling and d.periods, with noise on the
/// signal of the APD and on motor_torque, saturated where the signal's sensor is.
record::Record recorded(const record::Record& fine, const rig_file::RigFile& file, const Draw& d);

/// Both, of a machine drawn by d.seed (draw_machine).
record::Record simulate_draw(const rig_file::RigFile& file, const Draw& d);

/// The verdict as one more estimate, "combined"; `ambiguous` where its members contradict each other, for
/// nobody should rely on it.
diagnosis::Estimate estimate_of_verdict(const diagnosis::Verdict& verdict);

}  // namespace backlash::studies
