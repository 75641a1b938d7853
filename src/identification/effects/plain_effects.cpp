// SPDX-License-Identifier: BSD-3-Clause
// Effects that two encoders show plainly, without a simulation of the teeth (balance.h).
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "backlash_diagnosis/simulation/driven_load.h"
#include "balance.h"
#include "orthogonal_part.h"
#include "residual_orders.h"
#include "steps.h"

namespace backlash::identification {
namespace {

struct Plain {
  Candidate candidate;
  Balance::Explained explained;
};

/// Numbers that a fit of it has to find.
std::size_t unknowns(const Candidate& c) {
  return probed_terms(c).size() + c.terms.size() * model::term_type(c.id).search->shapes.size();
}

/// Those that convince in blocks that their size was not taken from, best first; of those that tie the
/// simplest.
std::vector<Plain> plain_candidates(const Hypothesis& h, const SearchContext& context, std::size_t lobes) {
  const SearchSettings& settings = context.settings;
  const AcceptanceSettings& acceptance = settings.acceptance;
  const Balance balance(h.fitted->fit.machine, context.data,
                        {settings.fit.cutoff, settings.fit.rough_cutoff});
  const auto column = [&](const model::Term& term) {
    return balance.column(term, settings.screen.least_own);
  };
  std::vector<Plain> all;
  const MachineFit& fit = h.fitted->fit;
  const OrthogonalPart left(fit, Eigen::Index(h.fitted->records.layout().size()));
  const ResidualOrders orders(fit, h.fitted->records, left);
  std::vector<Candidate> candidates;
  for (const Candidate& screened :
       screen(fit.machine.rig, orders, context.range, settings.screen, balance.left(), column)) {
    const auto near = lobes > 0 ? with_orders_near(screened, lobes, context.range, balance.left(), column)
                                : std::vector<Candidate>{screened};
    candidates.insert(candidates.end(), near.begin(), near.end());
  }
  for (const Candidate& c : candidates) {
    if (all.size() >= settings.trials.most) break;
    const auto terms = probed_terms(c);
    Eigen::MatrixXd columns(balance.left().size(), Eigen::Index(terms.size()));
    for (std::size_t i = 0; i < terms.size(); ++i) columns.col(Eigen::Index(i)) = column(*terms[i]);
    const Balance::Explained found = balance.explained(columns, acceptance.blocks, acceptance.earlier_part);
    if (found.gain_held_out >= settings.asked.least_gain_unclear && found.of_signal >= acceptance.noise &&
        found.better >= acceptance.most_blocks * acceptance.blocks)
      all.push_back({c, found});
  }
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
  // What every machine has is no effect of another name.
  const auto as_good = nearly(settings.revision.as_good);
  const auto usual = std::find_if(all.begin(), all.end(), [&](const Plain& p) {
    return is_usual(p.candidate, h.declared->rig) && as_good(p);
  });
  if (usual != all.end()) std::rotate(all.begin(), usual, usual + 1);
  return all;
}

/// One of them, with the others that explain nearly as much of the same channel.
Effect effect_of(const Plain& best, const std::vector<Plain>& plain, const SearchSettings& settings) {
  Effect effect{best.candidate, {}, {}, {}, {}};
  effect.gain.deflection = best.explained.deflection;
  const Balance::Explained& e = best.explained;
  effect.gain.evidence = {e.gain, e.gain_held_out, e.gain_forward, e.better, settings.acceptance.blocks};
  for (const Plain& other : plain)
    if (other.candidate.id != best.candidate.id && other.explained.deflection == best.explained.deflection &&
        other.explained.gain_held_out >= settings.revision.alike * best.explained.gain_held_out)
      effect.alternatives.push_back(other.candidate);
  return effect;
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

/// With one more effect, fitted from the values of the machine without it or, as these may have been bent to
/// stand in for it, from those of the file.
std::optional<Hypothesis> with_effect(const Hypothesis& h, const Effect& effect,
                                      const SearchContext& context) {
  std::vector<Effect> effects = h.effects;
  effects.push_back(effect);
  auto with = refitted(h, effects, context);
  if (!h.effects.empty()) return with;
  auto other = refitted(as_declared(h), std::move(effects), context);
  return other && (!with || size(*other) < size(*with)) ? other : with;
}

/// Fitted with the machine, the best of those that explain nearly as much of the same channel; of those that
/// come to the same the simplest. Both sums hardly show on which body a friction acts or which wave the
/// flanks have, and the motion of the load does.
std::optional<Hypothesis> with_best(const Hypothesis& h, const std::vector<Plain>& plain, std::size_t lobes,
                                    const SearchContext& context) {
  const SearchSettings& settings = context.settings;
  const Plain& first = plain.front();
  const bool usual = is_usual(first.candidate, h.declared->rig);
  std::vector<Hypothesis> fitted;
  for (const Plain& p : plain) {
    const bool alike = p.explained.deflection == first.explained.deflection &&
                       p.explained.gain_held_out >= settings.revision.alike * first.explained.gain_held_out;
    if (p.candidate.id != first.candidate.id && (usual || !alike)) continue;
    if (auto with = with_effect(h, effect_of(p, plain, settings), context))
      fitted.push_back(std::move(*with));
  }
  if (fitted.empty()) return std::nullopt;
  const auto least = std::min_element(fitted.begin(), fitted.end(),
                                      [](const auto& a, const auto& b) { return size(a) < size(b); });
  const double smallest = size(*least), enough = settings.revision.as_good * smallest;
  const std::string id = least->effects.back().candidate.id;
  fitted.erase(std::remove_if(fitted.begin(), fitted.end(),
                              [&](const auto& f) {  // of one effect with several orders the best
                                const bool other_order = lobes > 1 && f.effects.back().candidate.id == id;
                                return size(f) > (other_order ? smallest : enough);
                              }),
               fitted.end());
  return *std::min_element(fitted.begin(), fitted.end(), [](const auto& a, const auto& b) {
    return unknowns(a.effects.back().candidate) < unknowns(b.effects.back().candidate);
  });
}

}  // namespace

Hypothesis add_plain_effect(const Hypothesis& h, const SearchContext& context, std::size_t lobes) {
  if (!simulation::load_moves_freely(h.declared->rig)) return h;
  context.report("looking at the balance of torques and at the pressed flanks");
  const std::vector<Plain> plain = plain_candidates(h, context, lobes);
  if (plain.empty()) return h;
  const auto with = with_best(h, plain, lobes, context);
  const auto left = [&](const Hypothesis& of) {
    return plain.front().explained.deflection ? misfit(of).deflection : misfit(of).torque;
  };
  return with && left(*with) < left(h) ? with_best_shapes(*with, context) : h;
}

}  // namespace backlash::identification
