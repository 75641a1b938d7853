// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/fit/fit_settings.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/model/mesh_resonance.h"
#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/simulation/driven_load.h"

namespace backlash::identification {
namespace {

// In units of the mesh resonance; simulation.
constexpr double kCutoff = 60 / model::kTriedResonance;       // the oscillation after a touch is seen
constexpr double kRoughCutoff = 15 / model::kTriedResonance;  // it is not, the deflection under load is
constexpr double kFeedback =
    50 / model::kTriedResonance;  // 1/s per Hz: the oscillation stays, chaos in the gap does not

constexpr double kHighestCutoff =
    0.2;                          // theory: of the sampling rate, up to which differences are derivatives
constexpr double kPeriods = 100;  // choice: in all records: friction has more to say than a slow motion

/// Hz; of the fastest record.
double motion_cutoff(const std::vector<ServoData>& data) {
  double widest = 0, duration = 0;
  for (const ServoData& d : data) {
    widest = std::max({widest, signal::motion_bandwidth(d.motor, d.interval),
                       signal::torque_bandwidth(d.torque, d.motor, d.interval)});
    duration += double(d.size()) * d.interval;
  }
  return std::max(widest, kPeriods / duration);
}

}  // namespace

FitSettings with_bands(FitSettings settings, const model::Rig& rig, const std::vector<ServoData>& data) {
  const double highest = kHighestCutoff / data.front().interval;
  double torque = 0;
  for (const ServoData& d : data) torque = std::max(torque, model::usual_torque(d.torque));
  const double resonance = mesh_resonance(rig, torque);
  const bool free = simulation::load_moves_freely(rig) && resonance > 0;
  if (settings.cutoff == 0)
    settings.cutoff = std::min(free ? kCutoff * resonance : motion_cutoff(data), highest);
  if (settings.rough_cutoff == 0)
    settings.rough_cutoff = resonance > 0 ? kRoughCutoff * resonance : settings.cutoff;
  settings.rough_cutoff = std::min(settings.rough_cutoff, settings.cutoff);
  if (settings.feedback == 0) settings.feedback = kFeedback * resonance;
  return settings;
}

}  // namespace backlash::identification
