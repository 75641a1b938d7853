// SPDX-License-Identifier: BSD-3-Clause
#include "acceptance.h"

#include <fmt/format.h>

#include <algorithm>

#include "backlash_diagnosis/simulation/driven_load.h"

namespace backlash::identification {

double least_gain_in_noise(const RecordSet& records, const SearchSettings& settings) {
  const AcceptanceSettings& a = settings.acceptance;
  const double rows = 0.5 * double(records.layout().size());  // of a channel
  return std::clamp(a.sure * a.sure / (2 * rows), std::min(a.least_in_noise, settings.asked.least_gain),
                    settings.asked.least_gain);
}

std::string objection(const Gain& gain, const Machine& after, const RecordSet& records,
                      const SearchSettings& settings) {
  const AcceptanceSettings& a = settings.acceptance;
  const Misfit left = records.misfit(after);
  const bool clear = (gain.deflection ? left.deflection : left.torque) < a.near_floor;
  const bool noise = (gain.deflection ? left.deflection_share : left.torque_share) > a.noise;
  // Of a machine with one channel the friction is never quite what a term says, and that shows.
  const bool one_channel = !simulation::load_moves_freely(after.rig);
  const double least = !clear || one_channel ? settings.asked.least_gain_unclear
                       : noise               ? least_gain_in_noise(records, settings)
                                             : settings.asked.least_gain;
  const Evidence& e = gain.evidence;
  const char* channel = gain.deflection ? "deflection" : "torque";
  if (!(e.gain_held_out >= least))
    return fmt::format(
        "lessens the residual of {} in blocks left out of the fit by {:.2g} %, {:.2g} % are needed", channel,
        100 * e.gain_held_out, 100 * least);
  return "";
}

}  // namespace backlash::identification
