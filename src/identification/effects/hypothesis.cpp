// SPDX-License-Identifier: BSD-3-Clause
#include "hypothesis.h"

#include <algorithm>

#include "../fit/calibration.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "effect_roles.h"
#include "learned.h"

namespace backlash::identification {
namespace {

constexpr double kVanished = 0.01;  // choice: of a declared value; its logarithm hardly comes back

bool has(const std::vector<Effect>& effects, const std::string& id) {
  return std::any_of(effects.begin(), effects.end(), [&](const Effect& e) { return e.candidate.id == id; });
}

bool has(const std::vector<Effect>& effects, bool (*is)(const std::string& id)) {
  return std::any_of(effects.begin(), effects.end(), [&](const Effect& e) { return is(e.candidate.id); });
}

bool has_vanished(const FitParameter& p, const model::Rig& rig, const model::Rig& declared) {
  if (p.positive) return p.get(rig) < kVanished * p.get(declared);
  const rig_file::RigParameter& friction = rig_file::servo_parameter(p.name);
  return friction.kind == rig_file::ParameterKind::coulomb_friction && !friction.is_asymmetry() &&
         p.get(rig) <= 0;
}

BandFit fit_with_effects(Machine machine, bool delay, Settled settled, const SearchContext& context) {
  const FitSettings& settings = context.settings.fit;
  if (delay)
    without_calibration(machine);
  else
    machine.largest_delay = Machine().largest_delay;  // calibration may have stood in for the effect
  BandFit fitted = fit_settled(context.data, machine, settings.cutoff, settings.rough_tolerance, settings);
  if (settled == Settled::roughly) return fitted;
  Machine rough = fitted.fit.machine;
  if (!delay) {
    restore_hold(rough);
    limit_delay(rough, settings.calibration_delay);
  }
  return fit_settled(context.data, rough, settings.cutoff, settings.tolerance, settings);
}

}  // namespace

bool same_machine(const Hypothesis& a, const Hypothesis& b) {
  return a.other_teeth == b.other_teeth && a.behind_shaft == b.behind_shaft;
}

const Misfit& misfit(const Hypothesis& h) {
  return h.fitted->misfit;
}

double size(const Hypothesis& h) {
  return size(misfit(h));
}

bool clearly_right(const Misfit& misfit, const SearchContext& context) {
  return std::max(misfit.torque, misfit.deflection) < context.settings.revision.clearly_right;
}

bool has_learned_map(const std::vector<Effect>& effects) {
  return has(effects, is_learned);
}

Hypothesis with_rejected(Hypothesis h, const std::string& effect, const std::string& reason) {
  h.rejected.push_back({effect, reason});
  return h;
}

std::vector<RejectedEffect> rejected_effects(const Hypothesis& h) {
  std::vector<RejectedEffect> all;
  for (const RejectedEffect& r : h.rejected) {
    if (has(h.effects, r.id)) continue;
    const auto same = [&](const RejectedEffect& other) { return other.id == r.id; };
    all.erase(std::remove_if(all.begin(), all.end(), same), all.end());
    all.push_back(r);
  }
  return all;
}

Machine extended(Machine machine, const Candidate& candidate, const SearchContext& context) {
  if (!is_learned(candidate.id)) return with_candidate(std::move(machine), candidate, context.range);
  return with_map(std::move(machine), {candidate.terms.front(), candidate.smoothness, 0}, context.range,
                  context.settings.maps);
}

Machine with_vanished_again(Machine machine, const Machine& declared) {
  for (const FitParameter& p : machine.parameters) {
    const bool known = std::any_of(declared.parameters.begin(), declared.parameters.end(),
                                   [&](const FitParameter& d) { return d.name == p.name; });
    if (known && has_vanished(p, machine.rig, declared.rig)) p.set(machine.rig, p.get(declared.rig));
  }
  return machine;
}

Machine start_with(const Hypothesis& h, const std::vector<Effect>& effects, const SearchContext& context) {
  Machine machine = h.fitted->fit.machine;
  machine.rig.terms = h.declared->rig.terms;
  machine.parameters = h.declared->parameters;
  machine.priors = h.declared->priors;
  machine.has_map = false;
  machine.largest_delay = h.base->fit.machine.largest_delay;
  if (!effects.empty()) machine = with_vanished_again(std::move(machine), *h.declared);
  for (const Effect& effect : effects) machine = extended(std::move(machine), effect.candidate, context);
  return machine;
}

Hypothesis with_held(const Hypothesis& h, const FitParameter& parameter, double value) {
  Hypothesis held = h;
  BandFit fitted = *h.fitted;
  parameter.set(fitted.fit.machine.rig, value);
  held.fitted = std::make_shared<const BandFit>(std::move(fitted));
  Machine declared = *h.declared;
  declared.parameters.erase(std::remove_if(declared.parameters.begin(), declared.parameters.end(),
                                           [&](const FitParameter& p) { return p.name == parameter.name; }),
                            declared.parameters.end());
  held.declared = std::make_shared<const Machine>(std::move(declared));
  held.held[parameter.name] = value;
  return held;
}

std::optional<Hypothesis> refitted(const Hypothesis& h, std::vector<Effect> effects,
                                   const SearchContext& context, Settled settled) {
  auto fit = attempted([&] {
    return fit_with_effects(start_with(h, effects, context), has(effects, is_delay), settled, context);
  });
  if (!fit) return std::nullopt;
  Hypothesis other = h;
  other.fitted = std::make_shared<const BandFit>(std::move(*fit));
  const Machine& machine = other.fitted->fit.machine;
  std::size_t place = h.declared->rig.terms.size();
  for (Effect& effect : effects)
    for (ParameterValues& values : effect.candidate.terms) values = machine.rig.terms[place++]->values;
  if (!effects.empty()) effects.back().after = std::make_shared<const Machine>(machine);
  other.effects = std::move(effects);
  context.report_hypothesis(other);
  return other;
}

}  // namespace backlash::identification
