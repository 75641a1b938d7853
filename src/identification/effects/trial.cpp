// SPDX-License-Identifier: BSD-3-Clause
#include "trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "../fit/calibration.h"
#include "acceptance.h"
#include "effect_roles.h"

namespace backlash::identification {
namespace {

/// What the terms of a candidate have from their grids, in rising order.
std::vector<std::vector<double>> places(const Candidate& candidate) {
  std::vector<std::vector<double>> all;
  for (const ParameterValues& term : candidate.terms) {
    all.emplace_back();
    for (const model::TermShape& shape : model::term_type(candidate.id).search->shapes)
      if (!shape.refined) all.back().push_back(term.at(shape.name));
  }
  std::sort(all.begin(), all.end());
  return all;
}

/// The same with its t-th term's shape some places farther in the grid; nothing where that ends or where two
/// terms become one.
std::optional<Candidate> neighbour(const Candidate& candidate, std::size_t t, const model::TermShape& shape,
                                   long step, const model::MotionRange& range) {
  const std::vector<double> grid = shape.values(range);
  const long at =
      std::find(grid.begin(), grid.end(), candidate.terms[t].at(shape.name)) - grid.begin() + step;
  if (at < 0 || at >= long(grid.size())) return std::nullopt;
  for (const ParameterValues& term : candidate.terms)
    if (term.at(shape.name) == grid[std::size_t(at)]) return std::nullopt;
  Candidate other = candidate;
  other.terms[t][shape.name] = grid[std::size_t(at)];
  return other;
}

std::vector<Candidate> neighbours(const Candidate& candidate, const model::TermShape& shape,
                                  const model::MotionRange& range) {
  std::vector<Candidate> all;
  for (std::size_t t = 0; t < candidate.terms.size(); ++t)
    for (const long step : {-2L, -1L, 1L, 2L})
      if (const auto other = neighbour(candidate, t, shape, step, range)) all.push_back(*other);
  return all;
}

std::size_t shape_count(const Trial& trial) {
  return model::term_type(trial.candidate.id).search->shapes.size();
}

}  // namespace

std::optional<Trial> tried(const Hypothesis& h, const Candidate& candidate, const SearchContext& context,
                           double wanted) {
  const SearchSettings& settings = context.settings;
  const RecordSet& records = h.fitted->records;
  Trial trial{candidate, {}, {}, 0};
  const auto fit = attempted([&] {
    trial.start = extended(h.fitted->fit.machine, candidate, context);
    if (is_delay(candidate.id)) move_delay_to_term(trial.start, context.data.front().interval);
    const bool map = trial.start.has_map;
    const MachineFit rough =
        fit_machine(trial.start, records, fit_options(settings.fit, settings.fit.rough_tolerance, map));
    if (rough.fit.residuals.norm() > settings.trials.far_off * wanted)
      throw CannotIdentify("far from the residual that is wanted");
    trial.start = rough.machine;
    return fit_machine(trial.start, records, fit_options(settings.fit, settings.fit.tolerance, map));
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
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    const double worth =
        std::max(settings.worth_trying * candidates.front().gain,
                 settings.least_predicted * least_gain_in_noise(h.fitted->records, context.settings));
    if (i >= settings.most || c.gain < worth) {
      all.rejected.push_back(
          {c.id, fmt::format("not fitted: predicted to lessen the residual by {:.2g} %, {}", 100 * c.gain,
                             c.gain < worth ? "too little" : "others by more")});
      continue;
    }
    context.tell(fmt::format("trying {} (predicted gain {:.3g})", c.id, c.gain));
    if (auto trial = tried(h, c, context))
      all.fitted.push_back(std::move(*trial));
    else
      all.rejected.push_back({c.id, "the machine cannot be fitted with it"});
  }
  auto& fitted = all.fitted;
  std::stable_sort(fitted.begin(), fitted.end(),
                   [](const Trial& a, const Trial& b) { return a.residual < b.residual; });
  const auto tied = std::find_if(fitted.begin(), fitted.end(), [&](const Trial& t) {
    return t.residual > (1 + settings.tie) * fitted.front().residual;
  });
  std::stable_sort(fitted.begin(), tied,
                   [](const Trial& a, const Trial& b) { return shape_count(a) < shape_count(b); });
  return all;
}

Trial best_neighbour(const Hypothesis& h, const Trial& trial, const SearchContext& context) {
  if (clearly_right(h.fitted->records.misfit(trial.fit.machine), context)) return trial;
  const double less = 1 - context.settings.trials.better_neighbour;
  Trial best = trial;
  std::set<std::vector<std::vector<double>>> known;
  for (bool better = true; better;) {
    better = false;
    for (const model::TermShape& shape : model::term_type(best.candidate.id).search->shapes) {
      if (shape.refined || shape.values(context.range).size() < 2) continue;
      for (const Candidate& other : neighbours(best.candidate, shape, context.range)) {
        if (!known.insert(places(other)).second) continue;
        context.tell("trying " + best.candidate.id);
        auto fitted = tried(h, other, context, best.residual);
        if (!fitted || fitted->residual >= less * best.residual) continue;
        best = std::move(*fitted);
        better = true;
      }
    }
  }
  return best;
}

}  // namespace backlash::identification
