// SPDX-License-Identifier: BSD-3-Clause
// Sensitivities choose among the exponents of a law before any is fitted; on the way of a fit another may
// come out ahead.
#include "steps.h"

namespace backlash::identification {
namespace {

constexpr double kWorthMore = 0.8;     // choice: times what was left, where two more values are worth it
constexpr std::size_t kFewValues = 3;  // choice (time): of a shape, that all are fitted

/// The last effect with all values of its chosen shapes but those that it has.
std::vector<Effect> with_other_values(const Effect& effect, const SearchContext& context) {
  std::vector<Effect> all;
  const auto& search = model::term_type(effect.candidate.id).search;
  if (!search || effect.candidate.terms.size() != 1) return all;
  for (const model::TermShape& shape : search->shapes) {
    if (shape.refined) continue;  // fitted, or later
    const std::vector<double> values = shape.values(context.range);
    if (values.size() > kFewValues) continue;
    for (const double value : values)
      if (value != effect.candidate.terms[0].at(shape.name))
        all.emplace_back(effect).candidate.terms[0][shape.name] = value;
  }
  return all;
}

/// The last effect with all starts of the shapes that it did not have while it was looked for.
std::vector<Effect> with_later_shapes(const Effect& effect, const SearchContext& context) {
  const auto& search = model::term_type(effect.candidate.id).search;
  if (!search || effect.candidate.terms.size() != 1) return {};
  std::vector<Effect> all = {effect};
  for (const model::TermShape& shape : search->shapes) {
    if (!shape.later || effect.candidate.terms[0].at(shape.name) > 0) continue;
    std::vector<Effect> more;
    for (const Effect& one : all)
      for (const double value : shape.values(context.range))
        more.emplace_back(one).candidate.terms[0][shape.name] = value;
    all = std::move(more);
  }
  if (all.size() == 1) all.clear();
  return all;
}

}  // namespace

Hypothesis with_best_shapes(const Hypothesis& before, const SearchContext& context) {
  Hypothesis best = before;
  for (const Effect& other : with_later_shapes(before.effects.back(), context)) {
    context.report("trying more of " + other.candidate.id);
    std::vector<Effect> effects = before.effects;
    effects.back() = other;
    auto with = refitted(before, std::move(effects), context);
    if (with && size(*with) < kWorthMore * size(before) && size(*with) < size(best)) best = std::move(*with);
  }
  for (const Effect& other : with_other_values(before.effects.back(), context)) {
    context.report("trying another shape of " + other.candidate.id);
    std::vector<Effect> effects = before.effects;
    effects.back() = other;
    auto with = refitted(before, std::move(effects), context);
    if (with && size(*with) < size(best)) best = std::move(*with);
  }
  return best;
}

}  // namespace backlash::identification
