// SPDX-License-Identifier: BSD-3-Clause
// Sensitivities choose among the exponents of a law before any is fitted; on the way of a fit another may
// come out ahead.
#include "steps.h"

namespace backlash::identification {
namespace {

constexpr std::size_t kFewValues = 3;  // choice (time): of a shape, that all are fitted

/// The last effect with all values of its chosen shapes but those that it has.
std::vector<Effect> with_other_values(const Effect& effect, const SearchContext& context) {
  std::vector<Effect> all;
  const auto& search = model::term_type(effect.candidate.id).search;
  if (!search || effect.candidate.terms.size() != 1) return all;
  for (const model::TermShape& shape : search->shapes) {
    if (shape.refined) continue;
    const std::vector<double> values = shape.values(context.range);
    if (values.size() > kFewValues) continue;
    for (const double value : values)
      if (value != effect.candidate.terms[0].at(shape.name))
        all.emplace_back(effect).candidate.terms[0][shape.name] = value;
  }
  return all;
}

}  // namespace

Hypothesis with_best_shapes(const Hypothesis& before, const SearchContext& context) {
  Hypothesis best = before;
  for (const Effect& other : with_other_values(before.effects.back(), context)) {
    context.tell("trying another shape of " + other.candidate.id);
    std::vector<Effect> effects = before.effects;
    effects.back() = other;
    auto with = refitted(before, std::move(effects), context);
    if (with && size(*with) < size(best)) best = std::move(*with);
  }
  return best;
}

}  // namespace backlash::identification
