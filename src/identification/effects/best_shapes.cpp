// SPDX-License-Identifier: BSD-3-Clause
// Sensitivities choose among the exponents of a law before any is fitted; on the way of a fit another may
// come out ahead.
#include <algorithm>
#include <cmath>

#include "found_effects.h"
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
    if (shape.refined) continue;  // fitted, or later
    const std::vector<double> values = shape.values(context.range);
    if (values.size() > kFewValues) continue;
    for (const double value : values)
      if (value != effect.candidate.terms[0].at(shape.name))
        all.emplace_back(effect).candidate.terms[0][shape.name] = value;
  }
  return all;
}

/// The last effect with all starts of the shapes of this number, which it did not have while it was looked
/// for.
std::vector<Effect> with_later_shapes(const Hypothesis& h, int number, const SearchContext& context) {
  const Effect& effect = h.effects.back();
  const auto& search = model::term_type(effect.candidate.id).search;
  if (!search || effect.candidate.terms.size() != 1) return {};
  std::vector<Effect> all = {effect};
  for (const model::TermShape& shape : search->shapes) {
    if (shape.later != number || effect.candidate.terms[0].at(shape.name) > 0) continue;
    if (shape.of_one_body && !h.declared->rig.mesh.rigid) continue;
    std::vector<Effect> more;
    for (const Effect& one : all)
      for (const double value : shape.values(context.range))
        more.emplace_back(one).candidate.terms[0][shape.name] = value;
    all = std::move(more);
  }
  if (all.front().candidate.terms[0] == effect.candidate.terms[0]) all.clear();
  return all;
}

/// What may be left for the values of another of the last effect to be worth it: what is asked of an effect,
/// of each.
double worth(const Effect& before, const Effect& with, const SearchContext& context) {
  const auto fitted = [](const Effect& e) { return double(fitted_count(e.candidate, 0)); };
  return std::pow(1 - context.settings.asked.least_gain_unclear, fitted(with) - fitted(before));
}

int most_later(const Effect& effect) {
  int most = 0;
  if (const auto& search = model::term_type(effect.candidate.id).search)
    for (const model::TermShape& shape : search->shapes) most = std::max(most, shape.later);
  return most;
}

}  // namespace

Hypothesis with_best_shapes(const Hypothesis& before, const SearchContext& context) {
  Hypothesis best = before;
  for (int number = 1; number <= most_later(before.effects.back()); ++number) {
    const Hypothesis without = best;
    for (const Effect& other : with_later_shapes(without, number, context)) {
      context.report("trying more of " + other.candidate.id);
      std::vector<Effect> effects = without.effects;
      effects.back() = other;
      auto with = refitted(without, std::move(effects), context);
      const double most = worth(without.effects.back(), other, context) * size(without);
      if (with && size(*with) < std::min(most, size(best))) best = std::move(*with);
    }
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
