// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "contact_shape.h"
#include "effect_roles.h"
#include "steps.h"
#include "unseen_record.h"

namespace backlash::identification {
namespace {

constexpr double kOfGear = 0.01;  // choice: of the link's inertia, of a gear that has none of its own
constexpr double kShaft = 4;      // choice: times as stiff as the teeth, a start

/// The declared machine with other teeth or shafts, a start for fits.
Machine declared_with(const model::Rig& other, const Machine& declared) {
  Machine machine = declared;
  machine.rig = other;
  for (const rig_file::RigParameter& p : rig_file::servo_parameters()) {
    // A machine that lacks effects may have been fitted with friction below zero.
    if (p.is_friction() && p.get(other) <= 0) p.set(machine.rig, p.get(declared.rig));
  }
  machine.parameters = declared_parameters(machine.rig);
  return machine;
}

std::vector<Effect> without_stand_ins_for_teeth(std::vector<Effect> effects) {
  effects.erase(
      std::remove_if(effects.begin(), effects.end(),
                     [](const Effect& effect) { return stands_in_for_contact_law(effect.candidate.id); }),
      effects.end());
  return effects;
}

/// Of each effect the machine with those before it is kept, which the unseen record compares: all of these
/// are of the other machine.
std::optional<Hypothesis> fitted_with(const model::Rig& rig, const std::vector<Effect>& effects,
                                      const Hypothesis& h, const SearchContext& context) {
  Hypothesis other = h;
  other.declared = std::make_shared<const Machine>(declared_with(rig, *h.declared));
  other.base = std::make_shared<const BandFit>(
      fit_to_records(context.data, *other.declared, context.settings.fit,
                     [&] { context.report("trying other teeth and shafts"); }));
  other.fitted = other.base;
  other.effects.clear();
  for (const Effect& effect : effects) {
    std::vector<Effect> more = other.effects;
    more.push_back(effect);
    auto with = refitted(other, std::move(more), context);
    if (!with) return std::nullopt;
    other = std::move(*with);
  }
  context.report_hypothesis(other);
  return other;
}

/// Whether another machine is worth a fit beside this one.
bool promises(const model::Rig& other, const Hypothesis& h, const SearchContext& context) {
  const SearchSettings& settings = context.settings;
  const auto gain =
      attempted([&] { return predicted_gain(other, h.fitted->fit, h.fitted->records, settings.screen); });
  return gain && *gain >= settings.trials.least_predicted * (1 - settings.revision.clearly_less);
}

/// With the law that leaves least.
std::optional<Hypothesis> best_of(const std::vector<model::Rig>& laws, const std::vector<Effect>& effects,
                                  const Hypothesis& h, const SearchContext& context) {
  std::optional<Hypothesis> best;
  for (const model::Rig& teeth : laws) {
    auto with = attempted([&] { return fitted_with(teeth, effects, h, context); });
    if (with && *with && (!best || size(**with) < size(*best))) best = std::move(*with);
  }
  return best;
}

/// Effects of the teeth, each as the last of the shapes that are sought has it (of exponents the largest).
std::vector<Candidate> effects_of_teeth(const model::MotionRange& range) {
  std::vector<Candidate> all;
  for (const model::TermType& type : model::term_types()) {
    const auto is_chosen = [](const ParameterSpec& spec) { return !spec.choices.empty(); };
    if (!type.search || !type.search->phase.empty() ||
        std::any_of(type.parameters.begin(), type.parameters.end(), is_chosen))
      continue;  // of a body or a position
    ParameterValues values;
    values[type.search->strength] = type.search->typical(range);
    for (const model::TermShape& shape : type.search->shapes) values[shape.name] = shape.values(range).back();
    if (model::make_term(type.id, values)->loads_flanks()) all.push_back({type.id, {values}});
  }
  return all;
}

/// Whether linear teeth with one more effect of the teeth leave less: hardening by a power, as of cubic ones,
/// or what they lose.
bool rather_linear(const Hypothesis& other, const Hypothesis& h, const SearchContext& context) {
  for (const Candidate& candidate : effects_of_teeth(context.range)) {
    std::vector<Effect> effects = h.effects;
    effects.emplace_back().candidate = candidate;
    const auto with = attempted([&] { return refitted(h, std::move(effects), context); });
    if (with && *with && size(**with) < size(other)) return true;
  }
  return false;
}

/// Bearing and encoder before a shaft that turns the load; a start for fits.
std::optional<model::Rig> before_shaft(model::Rig rig, double torque) {
  if (!rig.output_coupling.rigid || !simulation::load_moves_freely(rig)) return std::nullopt;
  rig.output_coupling.stiffness = kShaft * torque / model::GearTrain(rig).elastic_deflection(torque);
  rig.output_coupling.rigid = false;
  rig.bearing_at_gear = true;
  if (!(rig.gear.inertia > 0)) rig.gear.inertia = kOfGear * rig.link.inertia;
  return rig;
}

/// Times the noise, of both channels of the unseen record.
double left_unseen(const Hypothesis& h, const SearchContext& context) {
  const ServoPrediction p = predicted(h.fitted->fit.machine, context.unseen, context.settings.fit);
  return std::hypot(p.torque_error.error / p.torque_error.floor,
                    p.deflection_error.error / p.deflection_error.floor);
}

}  // namespace

std::optional<Hypothesis> with_shaft(const Hypothesis& h, const SearchContext& context) {
  if (clearly_right(misfit(h), context)) return std::nullopt;
  const auto rig = before_shaft(h.base->fit.machine.rig, context.range.torque),
             beside = before_shaft(h.fitted->fit.machine.rig, context.range.torque);
  if (!beside || !promises(*beside, h, context)) return std::nullopt;
  auto other = attempted([&] { return fitted_with(*rig, h.effects, h, context); });
  if (!other || !*other || size(**other) >= context.settings.revision.clearly_less * size(h))
    return std::nullopt;
  const auto unseen = attempted([&] { return left_unseen(**other, context); });
  if (!unseen || *unseen >= left_unseen(h, context)) return std::nullopt;
  (*other)->behind_shaft = true;
  return *other;
}

std::optional<Hypothesis> with_other_teeth(const Hypothesis& h, const SearchContext& context) {
  const std::vector<Effect> others = without_stand_ins_for_teeth(h.effects);
  const bool harden = others.size() < h.effects.size();
  if (!harden && clearly_right(misfit(h), context)) return std::nullopt;
  const auto beside = with_hertzian_teeth(h.fitted->fit.machine.rig, context.range.torque);
  const auto promising = [&](const model::Rig& teeth) { return promises(teeth, h, context); };
  if (!harden && std::none_of(beside.begin(), beside.end(), promising)) return std::nullopt;
  // Of the machine without hardening, which has a stiffness of its own.
  const auto laws = with_hertzian_teeth(h.base->fit.machine.rig, context.range.torque);
  if (laws.empty()) return std::nullopt;
  context.report("trying other teeth");
  const auto other = best_of(laws, others, h, context);
  const RevisionSettings& revision = context.settings.revision;
  if (!other || size(*other) >= (harden ? revision.as_good : revision.clearly_less) * size(h))
    return std::nullopt;
  if (!harden && rather_linear(*other, h, context)) return std::nullopt;
  Hypothesis result = *other;
  result.other_teeth = true;
  for (const Effect& effect : h.effects)
    if (stands_in_for_contact_law(effect.candidate.id))
      result = with_rejected(std::move(result), effect.candidate.id,
                             "teeth of another law (Hertzian) explain it better");
  return result;
}

std::optional<Hypothesis> with_other_machine(const Hypothesis& h, const SearchContext& context) {
  auto shaft = with_shaft(h, context);
  if (shaft && clearly_right(misfit(*shaft), context)) return shaft;
  auto teeth = with_other_teeth(h, context);
  return shaft && (!teeth || size(*shaft) < size(*teeth)) ? shaft : teeth;
}

}  // namespace backlash::identification
