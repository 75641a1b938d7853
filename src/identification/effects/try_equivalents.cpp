// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "steps.h"

namespace backlash::identification {
namespace {

/// The effects with an alternative in place of the i-th effect, which becomes an alternative of it.
std::vector<Effect> swapped(std::vector<Effect> effects, std::size_t i, const std::string& alternative) {
  auto& others = effects[i].alternatives;
  std::swap(effects[i].candidate, *std::find_if(others.begin(), others.end(),
                                                [&](const Candidate& c) { return c.id == alternative; }));
  return effects;
}

}  // namespace

Hypothesis try_equivalents(const Hypothesis& before, const SearchContext& context) {
  const RevisionSettings& settings = context.settings.revision;
  Hypothesis h = before;
  for (std::size_t i = 0; i < h.effects.size(); ++i) {
    const std::vector<Candidate> alternatives = h.effects[i].alternatives;
    for (const Candidate& other : alternatives) {
      const std::string id = h.effects[i].candidate.id;
      context.tell("trying " + other.id + " instead of " + id);
      auto with = refitted(h, swapped(h.effects, i, other.id), context);
      if (!with) continue;
      const Hypothesis revised = drop_superfluous(*with, context);
      const bool fewer = revised.fitted->start.parameters.size() < h.fitted->start.parameters.size();
      if (size(revised) < (fewer ? settings.as_good : settings.clearly_less) * size(h)) {
        h = with_rejected(revised, id, "beside the other effects " + other.id + " explains it better");
        break;
      }
    }
  }
  return h;
}

}  // namespace backlash::identification
