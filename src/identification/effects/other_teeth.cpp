// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "contact_shape.h"
#include "effect_roles.h"
#include "steps.h"

namespace backlash::identification {
namespace {

/// The declared machine with other teeth, a start for fits.
Machine declared_with(const model::Rig& teeth, const Machine& declared) {
  Machine machine = declared;
  machine.rig = teeth;
  for (const rig_file::RigParameter& p : rig_file::servo_parameters()) {
    // A machine that lacks effects may have been fitted with friction below zero.
    if (p.is_friction() && p.get(teeth) <= 0) p.set(machine.rig, p.get(declared.rig));
  }
  machine.parameters = declared_parameters(machine.rig);
  return machine;
}

/// The machine as it is fitted now, with other teeth.
std::shared_ptr<const BandFit> with_teeth(BandFit fitted, const model::Mesh& teeth) {
  fitted.fit.machine.rig.mesh.contact = teeth.contact;
  return std::make_shared<const BandFit>(std::move(fitted));
}

std::vector<Effect> without_stand_ins_for_teeth(std::vector<Effect> effects) {
  effects.erase(
      std::remove_if(effects.begin(), effects.end(),
                     [](const Effect& effect) { return stands_in_for_contact_law(effect.candidate.id); }),
      effects.end());
  return effects;
}

Hypothesis fitted_with(const model::Rig& teeth, const std::vector<Effect>& effects, const Hypothesis& h,
                       const SearchContext& context) {
  Hypothesis start = h;
  start.declared = std::make_shared<const Machine>(declared_with(teeth, *h.declared));
  start.fitted = with_teeth(*h.fitted, teeth.mesh);
  std::optional<Hypothesis> with_effects;
  if (!effects.empty()) with_effects = refitted(start, effects, context);
  Hypothesis other = with_effects ? *with_effects : start;
  other.base = std::make_shared<const BandFit>(fit_to_records(
      context.data, *other.declared, context.settings.fit, [&] { context.report("trying other teeth"); }));
  other.other_teeth = true;
  if (!with_effects) {
    other.effects.clear();
    other.fitted = other.base;
  }
  context.report_hypothesis(other);
  return other;
}

}  // namespace

std::optional<Hypothesis> with_other_teeth(const Hypothesis& h, const SearchContext& context) {
  const std::vector<Effect> others = without_stand_ins_for_teeth(h.effects);
  if (others.size() == h.effects.size() || clearly_right(misfit(h), context)) return std::nullopt;
  // Of the machine without hardening, which has a stiffness of its own.
  const auto teeth = with_hertzian_teeth(h.base->fit.machine.rig, context.range.torque);
  if (!teeth) return std::nullopt;
  context.report("trying other teeth");
  const auto other = attempted([&] { return fitted_with(*teeth, others, h, context); });
  if (!other || size(*other) >= context.settings.revision.clearly_less * size(h)) return std::nullopt;
  Hypothesis result = *other;
  for (const Effect& effect : h.effects)
    if (stands_in_for_contact_law(effect.candidate.id))
      result = with_rejected(std::move(result), effect.candidate.id,
                             "teeth of another law (Hertzian) explain it better");
  return result;
}

}  // namespace backlash::identification
