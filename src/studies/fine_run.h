// SPDX-License-Identifier: BSD-3-Clause
// One simulated run of a rig, finer than it will be sampled, and what all runs of a curve share.
#pragma once

#include <vector>

#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/studies/curve_builder.h"
#include "drawn_machine.h"

namespace backlash::studies {

/// Everything that is the same for all backlash values of a curve.
struct CurvePlan {
  const rig_file::RigFile& file;
  CurveRequest request;
  diagnosis::ApdSettings apd;
  int phases;  // samplings of a fine run, each a fraction of a sample later than the one before
  std::vector<double> noise_levels;

  long run_periods() const { return static_cast<long>(apd.settling_periods) + request.periods; }
  /// Phase that a seed samples at: all are used evenly.
  int phase_of(int seed) const { return seed * phases / request.seeds % phases; }
};

/// Throws InvalidParameter for a request or rig that no curve can be made of.
CurvePlan plan_curve(const rig_file::RigFile& file, CurveRequest request);

/// The exact signal, `phases` times finer than the sampling, from rest.
struct FineRun {
  std::vector<double> signal, torque, position;
};
/// One for each machine; at once where they differ in numbers only. A tick for every period of each.
std::vector<FineRun> run_fine(const CurvePlan& plan, const std::vector<Machine>& machines, Ticker& ticker);
/// Machines that are worth moving at once.
constexpr std::size_t kTogether = 8;

Machine with_backlash(Machine machine, double backlash);

/// What the sensor reads of a fine run at one phase; `seed` is that of its noise (standard deviation, unit of
/// the signal).
std::vector<double> sample(const CurvePlan& plan, const FineRun& run, int phase, int seed, double noise);

}  // namespace backlash::studies
