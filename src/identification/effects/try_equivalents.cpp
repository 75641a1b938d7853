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

std::size_t shape_count(const std::string& id) {
  const model::TermType& type = model::term_type(id);
  return type.search ? type.search->shapes.size() : 0;
}

/// With `id` again in place of `other`, where that is the simpler name and what is left is as good: the other
/// may have been taken for what was dropped beside it.
Hypothesis with_simpler(const Hypothesis& revised, const std::string& id, const std::string& other,
                        const SearchContext& context) {
  if (shape_count(id) >= shape_count(other)) return revised;
  for (std::size_t i = 0; i < revised.effects.size(); ++i) {
    const Effect& effect = revised.effects[i];
    const bool has = std::any_of(effect.alternatives.begin(), effect.alternatives.end(),
                                 [&](const Candidate& c) { return c.id == id; });
    if (effect.candidate.id != other || !has) continue;
    auto back = refitted(revised, swapped(revised.effects, i, id), context);
    if (back && size(*back) < context.settings.revision.as_good * size(revised)) return std::move(*back);
  }
  return revised;
}

}  // namespace

Hypothesis try_equivalents(const Hypothesis& before, const SearchContext& context) {
  const RevisionSettings& settings = context.settings.revision;
  Hypothesis h = before;
  for (std::size_t i = 0; i < h.effects.size(); ++i) {
    const std::vector<Candidate> alternatives = h.effects[i].alternatives;
    for (const Candidate& other : alternatives) {
      const std::string id = h.effects[i].candidate.id;
      context.report("trying " + other.id + " instead of " + id);
      auto with = refitted(h, swapped(h.effects, i, other.id), context);
      if (!with) continue;
      const Hypothesis revised = with_simpler(drop_superfluous(*with, context), id, other.id, context);
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
