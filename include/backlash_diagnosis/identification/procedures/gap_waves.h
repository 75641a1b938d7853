// SPDX-License-Identifier: BSD-3-Clause
// What of the gap turns with another part than the load: a position of the load does not fix that of the
// pinion (Yumrukcal 2013, Section 5.4), so a map over one turn of the load averages it out.
//
// The separation of the flanks is taken at the same place of both runs, turns of the load not taken off,
// where their centre line cancels:
//
//   d_f(q) - d_r(q) = mean + sum over n of A_n sin(n q + phi_n) + sum over w of A_w sin(o_w q + phi_w)
//
// with n = 1, 2, ... of the load and other orders o_w [per turn of the load, any number]. With R turns of the
// pinion per turn of the load they are k R + n: n = 0 turns with the pinion alone, others with both gears. So
// the sum is the Fourier series of the gap over the angles of both, as far as the runs reach: with z1 and z2
// teeth the same two meet again after z1 / gcd(z1, z2) turns of the load.
//
// All whole orders up to the highest are fitted with every wave, so that a wave is only what no gap of the
// load can say, a local fault included: in little more than a turn that is shown by the stretch that is
// visited twice. A multiple of the pinion that is a whole number of the load is the load's. Orders that the
// drive declares are tried first, then any other; each must pass an F-test (correlation of the residual
// considered).
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/rig_file/drive.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

/// One wave of the gap.
struct GapWave {
  signal::Measured order;             // per turn of the load; without error where the drive declares it
  signal::Measured amplitude, phase;  // rad; of sin(order q + phase), q [rad] with its turns
  int pinion = 0, load = 0;           // k, n of order = k R + n; 0, 0: no order of the drive
  double chance = 1;                  // of so much or more by noise alone, all orders considered
};

/// A run one way: load position, turns not taken off, and motor minus load [rad].
struct GapRun {
  std::vector<double> load, difference;
};

struct GapWaveSettings {
  double highest_order = 60;   // choice: of all orders, three times that of the pinion of the thesis
  double false_alarm = 1e-4;   // choice: of one wave, all orders considered
  double least_amplitude = 0;  // rad; smaller ones are not reported
  const rig_file::Drive* drive = nullptr;  // may be null
};

struct GapWaves {
  std::vector<GapWave> waves;  // by order
  double turns = 0;            // of the load, that both runs visited, or each for itself
  double turns_to_meet = 0;    // after which the same teeth meet again; 0: not declared
  std::vector<std::string> warnings;

  double at(double position) const;  // rad, the sum of the waves; load position with its turns
};

/// Runs that share less than a turn of places, as two from one start, are fitted each over its own places,
/// with a centre line of the same orders. Finds nothing, with a warning where the drive declares a pinion, in
/// runs of less than a turn and some more. Throws InvalidParameter for settings that are not > 0.
GapWaves find_gap_waves(const GapRun& forward, const GapRun& reverse, const GapWaveSettings& settings = {});

}  // namespace backlash::identification
