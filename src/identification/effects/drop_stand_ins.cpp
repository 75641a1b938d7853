// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "backlash_diagnosis/simulation/driven_load.h"
#include "steps.h"

namespace backlash::identification {

// Friction of a machine with one channel is never quite what a term says, and its residual never at the
// floor; there what was found stands, and what remains is reported beside it.
Hypothesis drop_stand_ins(const Hypothesis& h, const SearchContext& context) {
  const double half = context.settings.revision.half;
  const Misfit& left = misfit(h);
  if (!simulation::load_moves_freely(h.declared->rig) || h.effects.empty()) return h;
  if (std::max(left.torque, left.deflection) < context.settings.acceptance.near_floor) return h;
  const bool half_explained = std::any_of(h.effects.begin(), h.effects.end(), [&](const Effect& effect) {
    return effect.gain.evidence.gain >= half;
  });
  if (half_explained && size(h) < half * size(h.base->misfit)) return h;
  Hypothesis none = h;
  none.effects.clear();
  none.fitted = h.base;
  for (const Effect& effect : h.effects)
    none = with_rejected(
        std::move(none), effect.candidate.id,
        "what is left stays far above the noise: it may stand in for an effect that has no name");
  return none;
}

}  // namespace backlash::identification
