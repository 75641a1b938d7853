// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "steps.h"

namespace backlash::identification {

Hypothesis reconsider(const Hypothesis& before, const SearchContext& context) {
  Hypothesis h = before;
  for (std::size_t i = 0; h.effects.size() > 1 && i < h.effects.size();) {
    if (clearly_right(misfit(h), context)) return h;
    const std::string id = h.effects[i].candidate.id;
    context.report("reconsidering " + id);
    const Hypothesis other = drop_superfluous(add_effects(without_effect(h, i, context), context), context);
    if (size(other) < context.settings.revision.clearly_less * size(h)) {
      h = with_rejected(
          other, id,
          fmt::format("stood in for others: without it {:.3g} times the floor is left, with it {:.3g}",
                      size(other), size(h)));
      i = 0;
    } else {
      ++i;
    }
  }
  return h;
}

}  // namespace backlash::identification
