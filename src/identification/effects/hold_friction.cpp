// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "friction_parameters.h"
#include "steps.h"

namespace backlash {
namespace {

/// The first friction that is below 0 in one direction or both: it, or the difference of the directions if it has one.
std::optional<FitParameter> negative_friction(const Hypothesis& h) {
  const std::vector<FitParameter>& all = h.declared->parameters;
  const Rig& rig = h.fitted->fit.machine.rig;
  const auto negative = std::find_if(all.begin(), all.end(), [&](const FitParameter& p) {
    return is_friction(p.name) && !is_asymmetry(p.name) && p.get(rig) < std::fabs(asymmetry(p.name, rig));
  });
  if (negative == all.end()) return std::nullopt;
  const auto difference = std::find_if(all.begin(), all.end(), [&](const FitParameter& p) {
    return p.name == asymmetry_of(negative->name);
  });
  return difference != all.end() ? *difference : *negative;
}

/// A hypothesis to start a fit from, with this parameter 0 and no longer fitted.
Hypothesis with_held(const Hypothesis& h, const FitParameter& parameter) {
  Hypothesis held = h;
  FittedMachine fitted = *h.fitted;
  parameter.set(fitted.fit.machine.rig, 0);
  held.fitted = std::make_shared<const FittedMachine>(std::move(fitted));
  Machine declared = *h.declared;
  declared.parameters.erase(std::remove_if(declared.parameters.begin(), declared.parameters.end(),
                                           [&](const FitParameter& p) { return p.name == parameter.name; }),
                            declared.parameters.end());
  held.declared = std::make_shared<const Machine>(std::move(declared));
  held.held.push_back(parameter.name);
  return held;
}

}  // namespace

Hypothesis hold_friction(const Hypothesis& before, const SearchContext& context) {
  const FitSettings& settings = context.settings.fit;
  Hypothesis h = before;
  while (const auto negative = negative_friction(h)) {
    const Hypothesis held = with_held(h, *negative);
    if (h.effects.empty()) {
      h = held;
      h.fitted = std::make_shared<const FittedMachine>(fit_in_band(
          context.data, start_with(held, {}, context), settings.cutoff, settings.tolerance, settings));
      continue;
    }
    auto with = refitted(held, held.effects, context);
    if (!with)
      throw CannotIdentify(negative->name + " comes out below 0, and with 0 the machine cannot be fitted");
    h = std::move(*with);
  }
  return h;
}

}  // namespace backlash
