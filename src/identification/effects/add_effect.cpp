// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "acceptance.h"
#include "effect_roles.h"
#include "steps.h"
#include "trial.h"

namespace backlash::identification {
namespace {

constexpr const char* kNotFitted = "the machine cannot be fitted with it at new weights";

bool nothing_can_be_found(const Misfit& m, const SearchSettings& settings) {
  return std::max(m.torque, m.deflection) < settings.revision.at_floor &&
         std::max(m.torque_share, m.deflection_share) < settings.acceptance.noise;
}

HeldOut held_out_of(const Trial& trial, const Hypothesis& h, const SearchContext& context) {
  return held_out(trial.fit, h.fitted->records, context.settings.acceptance);
}

/// The other trials that gain nearly as much as `best`.
std::vector<Fitted> alternatives(const Trial& best, double gain, const std::vector<Trial>& trials,
                                 const HeldOut& now, const Hypothesis& h, const SearchContext& context) {
  std::vector<Fitted> all;
  for (const Trial& other : trials) {
    if (other.candidate.id == best.candidate.id) continue;
    const Gain of_other = compare(now, held_out_of(other, h, context));
    if (of_other.total >= context.settings.revision.alike * gain) all.push_back({other.candidate, of_other});
  }
  return all;
}

/// Fitted wholly; `before` where that fails.
Hypothesis settled(const Hypothesis& with, const Hypothesis& before, const SearchContext& context) {
  const auto whole = refitted(with, with.effects, context);
  return whole ? with_best_shapes(*whole, context)
               : with_rejected(before, with.effects.back().candidate.id, kNotFitted);
}

}  // namespace

Hypothesis add_effect(const Hypothesis& before, const SearchContext& context) {
  const Misfit& left = misfit(before);
  if (nothing_can_be_found(left, context.settings)) return before;
  context.report(fmt::format("screening (torque {:.3g}, deflection {:.3g} times the noise floor)",
                             left.torque, left.deflection));
  const RecordSet& records = before.fitted->records;
  const Trials trials = tried_best(
      before, screen(before.fitted->fit, records, context.range, context.settings.screen), context);
  Hypothesis h = before;
  for (const RejectedEffect& r : trials.rejected) h = with_rejected(std::move(h), r.id, r.reason);
  const HeldOut now = held_out(before.fitted->fit, records, context.settings.acceptance);
  std::optional<Hypothesis> vague;  // explains as well with values that the records do not determine
  for (const Trial& best : trials.fitted) {
    const Gain gain = compare(now, held_out_of(best, before, context));
    const bool of_teeth = h.other_teeth && stands_in_for_contact_law(best.candidate.id);
    const std::string reason =
        of_teeth ? "teeth of another law are in the model, and no law is quite that of real teeth"
                 : objection(gain, best.fit.machine, records, context.settings);
    if (!reason.empty()) {
      h = with_rejected(std::move(h), best.candidate.id, reason);
      continue;
    }
    std::vector<Effect> effects = h.effects;
    effects.push_back({{best.candidate, gain},
                       alternatives(best, gain.total, trials.fitted, now, before, context),
                       {},
                       {}});
    auto with = refitted(h, std::move(effects), context, Settled::roughly);
    std::string why = with ? contradicted_by_unseen(*with, context) : kNotFitted;
    if (!why.empty())
      h = with_rejected(std::move(h), best.candidate.id, why);
    else if (!last_is_vague(*with, context))
      return settled(*with, h, context);
    else if (!vague)
      vague = with;
  }
  return vague ? settled(*vague, h, context) : h;
}

Hypothesis add_effects(const Hypothesis& before, const SearchContext& context) {
  Hypothesis h = before;
  while (h.effects.size() < context.settings.asked.most_effects) {
    const std::size_t count = h.effects.size();
    h = add_effect(h, context);
    if (h.effects.size() == count) break;
  }
  return h;
}

Hypothesis add_effects_or_teeth(const Hypothesis& before, const SearchContext& context) {
  Hypothesis h = before;
  std::size_t tried_with = 0;  // effects, when another machine was tried last in vain
  for (;;) {
    const std::size_t count = h.effects.size();
    if (count < context.settings.asked.most_effects) h = add_effect(h, context);
    const bool more = h.effects.size() > count;
    const bool hardening = more && stands_in_for_contact_law(h.effects.back().candidate.id);
    if ((hardening || !more) && tried_with != h.effects.size()) {
      if (auto other = with_other_machine(h, context)) {
        h = std::move(*other);
        continue;
      }
      tried_with = h.effects.size();
    }
    if (!more) return h;
  }
}

}  // namespace backlash::identification
