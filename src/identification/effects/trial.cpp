// SPDX-License-Identifier: BSD-3-Clause
#include "trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "../fit/calibration.h"
#include "acceptance.h"
#include "effect_roles.h"

namespace backlash::identification {
namespace {

/// The same at the whole numbers on either side of its orders, where `held` has an error for them: all
/// combinations but those where two terms become one.
std::vector<Candidate> at_whole_orders(const Candidate& candidate, const std::vector<double>& held) {
  std::vector<Candidate> all = {candidate};
  for (const model::TermShape& shape : model::term_type(candidate.id).search->shapes)
    for (std::size_t i = 0; shape.wave && i < held.size(); ++i) {
      if (held[i] == 0) continue;
      std::vector<Candidate> more;
      for (const Candidate& c : all) {
        const double order = c.terms[i].at(shape.name);
        for (const double whole : std::set<double>{std::floor(order), std::ceil(order)})
          if (whole > 0 && (i == 0 || whole != c.terms[0].at(shape.name)))
            more.emplace_back(c).terms[i][shape.name] = whole;
      }
      all = std::move(more);
    }
  for (Candidate& c : all) c.held_orders = held;
  return all;
}

}  // namespace

std::optional<Trial> tried(const Hypothesis& h, const Candidate& candidate, const SearchContext& context) {
  const SearchSettings& settings = context.settings;
  const RecordSet& records = h.fitted->records;
  Trial trial{candidate, {}, {}, 0};
  const auto fit = attempted([&] {
    trial.start = with_vanished_again(extended(h.fitted->fit.machine, candidate, context), *h.declared);
    if (is_delay(candidate.id)) move_delay_to_term(trial.start, context.data.front().interval);
    const bool map = trial.start.has_map;
    return fit_machine(trial.start, records, fit_options(settings.fit, settings.fit.rough_tolerance, map));
  });
  if (!fit) return std::nullopt;
  trial.fit = *fit;
  trial.residual = trial.fit.fit.residuals.norm();
  const auto& terms = trial.fit.machine.rig.terms;
  for (std::size_t i = 0; i < candidate.terms.size(); ++i)
    trial.candidate.terms[i] = terms[terms.size() - candidate.terms.size() + i]->values;
  return trial;
}

Trials tried_best(const Hypothesis& h, const std::vector<Candidate>& candidates,
                  const SearchContext& context) {
  const TrialSettings& settings = context.settings.trials;
  Trials all;
  // Beside a map each fit takes long, and what is left of the map itself is no reason to try.
  const double least = has_learned_map(h.effects) ? context.settings.asked.least_gain_unclear
                                                  : least_gain_in_noise(h.fitted->records, context.settings);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    const double worth =
        std::max(settings.worth_trying * candidates.front().gain, settings.least_predicted * least);
    if (i >= settings.most || c.gain < worth) {
      all.rejected.push_back(
          {c.id, fmt::format("not fitted: predicted to lessen the residual by {:.2g} %, {}", 100 * c.gain,
                             c.gain < worth ? "too little" : "others by more")});
      continue;
    }
    context.report(fmt::format("trying {} (predicted gain {:.3g})", c.id, c.gain));
    if (auto trial = tried(h, c, context))
      all.fitted.push_back(with_free_orders(h, *trial, context));
    else
      all.rejected.push_back({c.id, "the machine cannot be fitted with it"});
  }
  auto& fitted = all.fitted;
  std::stable_sort(fitted.begin(), fitted.end(),
                   [](const Trial& a, const Trial& b) { return a.residual < b.residual; });
  const auto tied = std::find_if(fitted.begin(), fitted.end(), [&](const Trial& t) {
    return t.residual > (1 + settings.tie) * fitted.front().residual;
  });
  std::stable_sort(fitted.begin(), tied, [](const Trial& a, const Trial& b) {
    return shape_count(a.candidate) < shape_count(b.candidate);
  });
  return all;
}

bool holds_orders(const Candidate& candidate) {
  return std::any_of(candidate.held_orders.begin(), candidate.held_orders.end(),
                     [](double error) { return error > 0; });
}

// In times the noise floor: rows are weighed by what the machine left without the effect.
Trial with_free_orders(const Hypothesis& h, const Trial& trial, const SearchContext& context) {
  const std::vector<double>& held = trial.candidate.held_orders;
  const auto left = [&](const Trial& t) { return size(h.fitted->records.misfit(t.fit.machine)); };
  if (!holds_orders(trial.candidate) || clearly_right(h.fitted->records.misfit(trial.fit.machine), context))
    return trial;
  Candidate free = trial.candidate;
  free.held_orders.clear();
  context.report("fitting the order of " + free.id);
  const auto fitted = tried(h, free, context);
  if (!fitted) return trial;
  Trial best = trial;
  for (const Candidate& whole : at_whole_orders(fitted->candidate, held)) {
    auto rounded = tried(h, whole, context);
    if (rounded && left(*rounded) < left(best)) best = std::move(*rounded);
  }
  return left(*fitted) < context.settings.revision.clearly_less * left(best) ? *fitted : best;
}

}  // namespace backlash::identification
