// SPDX-License-Identifier: BSD-3-Clause
// Effects that two encoders show plainly, without a simulation of the teeth (balance.h).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "backlash_diagnosis/simulation/driven_load.h"
#include "balance.h"
#include "steps.h"
#include "trial.h"

namespace backlash::identification {
namespace {

struct Plain {
  Candidate candidate;
  Balance::Explained explained;
};

/// Numbers that a fit of it has to find.
std::size_t unknowns(const Candidate& c) {
  return probed_terms(c).size() + shape_count(c);
}

/// Where the machine's values are those of its file.
Hypothesis as_declared(const Hypothesis& h) {
  Hypothesis declared = h;
  BandFit fitted = *h.fitted;
  fitted.fit.machine.rig = h.declared->rig;
  fitted.fit.machine.calibrations = h.declared->calibrations;
  declared.fitted = std::make_shared<const BandFit>(std::move(fitted));
  return declared;
}

/// Those that convince in blocks that their size was not taken from, best first; of those that tie the
/// simplest.
std::vector<Plain> plain_candidates(const Hypothesis& h, const SearchContext& context) {
  const SearchSettings& settings = context.settings;
  const AcceptanceSettings& acceptance = settings.acceptance;
  const Machine machine = (h.effects.empty() ? as_declared(h) : h).fitted->fit.machine;
  const Balance balance(machine, context.data, {settings.fit.cutoff, settings.fit.rough_cutoff});
  const auto column = [&](const model::Term& term) {
    return balance.column(term, settings.screen.least_own);
  };
  std::vector<Plain> all;
  for (const Candidate& c :
       screen(machine.rig, balance.orders(), context.range, settings.screen, balance.left(), column)) {
    const auto terms = probed_terms(c);
    Eigen::MatrixXd columns(balance.left().size(), Eigen::Index(terms.size()));
    for (std::size_t i = 0; i < terms.size(); ++i) columns.col(Eigen::Index(i)) = column(*terms[i]);
    const Balance::Explained found = balance.explained(columns, acceptance.blocks);
    if (found.gain_held_out >= settings.asked.least_gain_unclear && found.of_signal >= acceptance.noise)
      all.push_back({c, found});
  }
  std::stable_sort(all.begin(), all.end(), [](const Plain& a, const Plain& b) {
    return a.explained.gain_held_out > b.explained.gain_held_out;
  });
  if (all.size() > settings.trials.most) all.resize(settings.trials.most);
  if (all.empty()) return all;
  const auto nearly = [&](double factor) {
    return [&, factor](const Plain& p) {
      return p.explained.deflection == all.front().explained.deflection &&
             1 - p.explained.gain_held_out <= factor * (1 - all.front().explained.gain_held_out);
    };
  };
  const auto tied = std::find_if_not(all.begin(), all.end(), nearly(1 + settings.trials.tie));
  std::stable_sort(all.begin(), tied, [](const Plain& a, const Plain& b) {
    return unknowns(a.candidate) < unknowns(b.candidate);
  });
  return all;
}

Fitted fitted(const Plain& p, const SearchSettings& settings) {
  const Balance::Explained& e = p.explained;
  Fitted f{p.candidate, {}};
  f.gain.deflection = e.deflection;
  f.gain.evidence = {e.gain, e.gain_held_out};
  return f;
}

/// One of them, with the others that explain nearly as much of the same channel.
Effect effect_of(const Plain& best, const std::vector<Plain>& plain, const SearchSettings& settings) {
  Effect effect{fitted(best, settings), {}, {}, {}};
  for (const Plain& other : plain)
    if (other.candidate.id != best.candidate.id && other.explained.deflection == best.explained.deflection &&
        other.explained.gain_held_out >= settings.revision.alike * best.explained.gain_held_out)
      effect.alternatives.push_back(fitted(other, settings));
  return effect;
}

/// With one more effect, fitted roughly: the first from the values of the file, as those of the machine
/// without it may have been bent to stand in for it.
std::optional<Hypothesis> with_effect(const Hypothesis& h, const Effect& effect,
                                      const SearchContext& context) {
  std::vector<Effect> effects = h.effects;
  effects.push_back(effect);
  return refitted(h.effects.empty() ? as_declared(h) : h, std::move(effects), context, Settled::roughly);
}

/// Of both channels, each in its own unit: what a likelihood with unknown noise of either compares.
double left(const Hypothesis& h) {
  return misfit(h).torque * misfit(h).deflection;
}

/// Fitted roughly with the machine, the best of those that explain nearly most of a channel; of those that
/// come to the same the simplest. Both sums hardly show on which body a friction acts or which wave the
/// flanks have, and the motion of the load does.
std::optional<Hypothesis> with_best(const Hypothesis& h, const std::vector<Plain>& plain,
                                    const SearchContext& context) {
  const SearchSettings& settings = context.settings;
  std::vector<Hypothesis> fitted;
  for (const Plain& p : plain) {
    const Plain& first = *std::find_if(plain.begin(), plain.end(), [&](const Plain& other) {
      return other.explained.deflection == p.explained.deflection;
    });
    const bool usual = is_usual(first.candidate, h);
    const bool alike = p.explained.gain_held_out >= settings.revision.alike * first.explained.gain_held_out;
    if (p.candidate.id != first.candidate.id && (usual || !alike)) continue;
    if (auto with = with_effect(h, effect_of(p, plain, settings), context))
      fitted.push_back(std::move(*with));
  }
  if (fitted.empty()) return std::nullopt;
  double least = INFINITY;
  for (const Hypothesis& f : fitted) least = std::min(least, left(f));
  const auto best = std::min_element(fitted.begin(), fitted.end(), [&](const auto& a, const auto& b) {
    const auto rank = [&](const Hypothesis& f) {
      return std::pair{left(f) > settings.revision.as_good * least, unknowns(f.effects.back().candidate)};
    };
    return rank(a) < rank(b);
  });
  return *best;
}

/// With the orders of the last that the motion of the load shows: the flanks alone show only which of those
/// that were tried are near.
std::vector<Effect> with_orders(const Hypothesis& before, std::vector<Effect> effects,
                                const SearchContext& context) {
  const Hypothesis h = before.effects.empty() ? as_declared(before) : before;
  Candidate& last = effects.back().candidate;
  if (holds_orders(last))
    if (const auto trial = tried(h, last, context)) last = with_free_orders(h, *trial, context).candidate;
  return effects;
}

}  // namespace

Hypothesis add_plain_effect(const Hypothesis& h, const SearchContext& context) {
  if (!simulation::load_moves_freely(h.declared->rig)) return h;
  context.report("looking at the balance of torques and at the pressed flanks");
  const std::vector<Plain> plain = plain_candidates(h, context);
  const auto best = plain.empty() ? std::nullopt : with_best(h, plain, context);
  if (!best) return h;
  const auto of_channel = [&](const Hypothesis& of) {
    return best->effects.back().gain.deflection ? misfit(of).deflection : misfit(of).torque;
  };
  if (!(of_channel(*best) < (1 - context.settings.asked.least_gain_unclear) * of_channel(h))) return h;
  const auto with = refitted(*best, with_orders(h, best->effects, context), context);
  return with ? with_best_shapes(*with, context) : h;
}

}  // namespace backlash::identification
