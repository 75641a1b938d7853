// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "acceptance.h"
#include "steps.h"

namespace backlash::identification {
namespace {

/// Whether the others, fitted with the same weights, leave so much more that the effect convinces beside
/// them.
bool needed(const Hypothesis& h, std::size_t effect, const SearchContext& context) {
  const SearchSettings& settings = context.settings;
  const RecordSet& records = h.fitted->records;
  std::vector<Effect> fewer = h.effects;
  fewer.erase(fewer.begin() + long(effect));
  Machine start = start_with(h, fewer, context);
  const auto fit = attempted([&] {
    start =
        fit_machine(start, records, fit_options(settings.fit, settings.fit.rough_tolerance, false)).machine;
    return fit_machine(start, records, fit_options(settings.fit, settings.fit.tolerance, false));
  });
  if (!fit) return true;
  const Gain gain = compare(held_out(*fit, start, records, settings.acceptance),
                            held_out(h.fitted->fit, h.fitted->start, records, settings.acceptance));
  return objection(gain, h.fitted->fit.machine, records, settings).empty();
}

}  // namespace

Hypothesis without_effect(const Hypothesis& h, std::size_t effect, const SearchContext& context) {
  const auto place = h.effects.begin() + long(effect);
  Hypothesis without = h;
  without.effects.clear();
  without.fitted = h.base;
  const auto add = [&](std::vector<Effect> more) {
    auto with = refitted(without, std::move(more), context);
    if (with) without = std::move(*with);
  };
  if (effect > 0) add({h.effects.begin(), place});
  for (auto one = place + 1; one != h.effects.end(); ++one) {
    std::vector<Effect> more = without.effects;
    more.push_back(*one);
    add(std::move(more));
  }
  return without;
}

Hypothesis drop_superfluous(const Hypothesis& before, const SearchContext& context) {
  Hypothesis h = before;
  for (std::size_t i = 0; h.effects.size() > 1 && i < h.effects.size();) {
    const std::string id = h.effects[i].candidate.id;
    context.report("doing without " + id);
    if (needed(h, i, context)) {
      ++i;
      continue;
    }
    const Hypothesis without = without_effect(h, i, context);
    // Learned maps do not always find their way back from the machine without it.
    const double allowed = 1 - context.settings.asked.least_gain_unclear;
    if (has_learned_map(h.effects) && size(without) * allowed >= size(h))
      ++i;
    else
      h = with_rejected(without, id, "the other effects explain the same");
  }
  return h;
}

}  // namespace backlash::identification
