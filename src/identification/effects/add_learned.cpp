// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "acceptance.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "effect_roles.h"
#include "learned.h"
#include "steps.h"
#include "trial.h"

namespace backlash::identification {
namespace {

std::vector<std::string> nearest_effects(const Hypothesis& h, const SearchContext& context) {
  std::vector<std::string> ids;
  for (const Candidate& c : screen(h.fitted->fit, h.fitted->records, context.range, context.settings.screen))
    if (ids.size() < context.settings.maps.nearest) ids.push_back(c.id);
  return ids;
}

/// With the effects alone that explain more than half of their residual. Friction of one channel always is
/// such a rest.
Hypothesis without_stand_ins(const Hypothesis& named, const SearchContext& context) {
  Hypothesis h = named;
  if (!simulation::load_moves_freely(h.declared->rig)) return h;
  for (std::size_t i = h.effects.size(); i-- > 0;)
    if (i < h.effects.size() && h.effects[i].gain.evidence.gain < context.settings.revision.half)
      h = without_effect(h, i, context);
  return h;
}

}  // namespace

Hypothesis add_map(const Hypothesis& before, const SearchContext& context) {
  context.report("learning maps");
  const SearchSettings& settings = context.settings;
  const double least = settings.asked.least_gain_unclear;
  const RecordSet& records = before.fitted->records;
  const std::vector<LearnedCandidate> maps =
      learn_maps(before.fitted->fit, records, context.range, settings.maps);
  const HeldOut now = held_out(before.fitted->fit, records, settings.acceptance);
  Hypothesis h = before;
  for (std::size_t i = 0; i < std::min(settings.maps.trials, maps.size()); ++i) {
    if (maps[i].gain < settings.trials.least_predicted * least) break;
    const auto trial = tried(h, {map_term().id, {maps[i].values}, maps[i].gain, maps[i].smoothness}, context);
    if (!trial) continue;
    const Gain gain = compare(now, held_out(trial->fit, records, settings.acceptance));
    std::string reason = objection(gain, trial->fit.machine, records, settings);
    if (reason.empty() && gain.evidence.gain_held_out < least)
      reason = "lessens the residual in blocks left out of the fit by too little";
    if (reason.empty()) {
      std::vector<Effect> effects = h.effects;
      effects.push_back({{trial->candidate, gain}, {}, nearest_effects(h, context), {}});
      if (auto with = refitted(h, std::move(effects), context)) return *with;
      reason = "the machine cannot be fitted with it at new weights";
    }
    h = with_rejected(std::move(h), map_term().id, reason);
  }
  return h;
}

Hypothesis add_learned(const Hypothesis& named, const SearchContext& context) {
  const SearchSettings& settings = context.settings;
  const Misfit& left = misfit(named);
  if (std::max(left.torque, left.deflection) < settings.maps.something_left ||
      std::max(left.torque_share, left.deflection_share) < settings.acceptance.noise)
    return named;
  Hypothesis h = without_stand_ins(named, context);
  const std::size_t count = h.effects.size();
  h = add_map(h, context);  // one: a machine that is described by several tables is not understood
  const bool helped = h.effects.size() > count;
  if (helped) h = add_effects(h, context);
  if (helped && size(h) < (1 - settings.asked.least_gain_unclear) * size(named)) return h;
  Hypothesis rest = named;
  rest.rejected = h.rejected;
  return helped ? with_rejected(rest, map_term().id, "leaves hardly less than the named effects do") : rest;
}

}  // namespace backlash::identification
