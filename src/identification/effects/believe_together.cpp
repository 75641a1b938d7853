// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "steps.h"
#include "unseen_record.h"

namespace backlash::identification {
namespace {

/// Whether the unseen record is predicted better than by the declared machine. The error of the signal
/// counts, which a delay moves to where it may be smaller.
bool better_together(const Hypothesis& h, const Hypothesis& declared, const ServoData& unseen,
                     const SearchContext& context) {
  const ServoPrediction was = predicted(declared.base->fit.machine, unseen, context.settings.fit),
                        is = predicted(h.fitted->fit.machine, unseen, context.settings.fit);
  return std::any_of(h.effects.begin(), h.effects.end(), [&](const Effect& effect) {
    const auto channel =
        effect.gain.deflection ? &ServoPrediction::deflection_error : &ServoPrediction::torque_error;
    return (is.*channel).error < (was.*channel).error;
  });
}

}  // namespace

Hypothesis believe_together(const Hypothesis& h, const Hypothesis& declared, const ServoData& unseen,
                            const SearchContext& context) {
  if (h.effects.empty() || better_together(h, declared, unseen, context)) return h;
  Hypothesis none = declared;
  none.rejected = h.rejected;
  for (const Effect& effect : h.effects)
    none = with_rejected(std::move(none), effect.candidate.id,
                         "the unseen record is predicted no better than by the declared machine");
  return none;
}

}  // namespace backlash::identification
