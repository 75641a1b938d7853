// SPDX-License-Identifier: BSD-3-Clause
// Beside the effects that were found later a name with fewer unknowns may explain the same: gravity, where
// cogging of an order near 1 took a part of them.
#include <algorithm>
#include <utility>

#include "found_effects.h"
#include "steps.h"

namespace backlash::identification {
namespace {

/// Numbers that a fit of it finds.
std::size_t unknowns_of(const Candidate& candidate) {
  std::size_t count = 0;
  for (std::size_t t = 0; t < candidate.terms.size(); ++t) count += fitted_count(candidate, t);
  return count;
}

}  // namespace

Hypothesis take_simpler(const Hypothesis& before, const SearchContext& context) {
  Hypothesis h = before;
  for (std::size_t i = 0; i < h.effects.size(); ++i) {
    const Effect now = h.effects[i];
    for (std::size_t k = 0; k < now.alternatives.size(); ++k) {
      const Candidate& other = now.alternatives[k].candidate;
      if (unknowns_of(other) >= unknowns_of(now.candidate)) continue;
      context.report("trying " + other.id + " instead of " + now.candidate.id);
      std::vector<Effect> effects = h.effects;
      std::swap(static_cast<Fitted&>(effects[i]), effects[i].alternatives[k]);
      auto with = refitted(h, std::move(effects), context);
      if (!with || size(*with) >= context.settings.revision.as_good * size(h)) continue;
      h = with_rejected(std::move(*with), now.candidate.id,
                        other.id + " explains the same and has fewer values");
      break;
    }
  }
  return h;
}

}  // namespace backlash::identification
