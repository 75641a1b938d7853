// SPDX-License-Identifier: BSD-3-Clause
#include "steps.h"

namespace backlash::identification {
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

}  // namespace backlash::identification
