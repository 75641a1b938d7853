// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "steps.h"

namespace backlash::identification {
namespace {

/// Friction below 0, of one direction or of both: it would drive the body.
bool drives(const FitParameter& p, const model::Rig& rig) {
  const rig_file::RigParameter& friction = rig_file::servo_parameter(p.name);
  if (!friction.is_friction() || friction.is_asymmetry()) return false;
  const rig_file::RigParameter* asymmetry = rig_file::asymmetry_of(friction);
  return p.get(rig) < (asymmetry ? std::fabs(asymmetry->get(rig)) : 0);
}

/// The first friction that drives, or the difference of its directions where that is fitted.
std::optional<FitParameter> negative_friction(const Hypothesis& h) {
  const std::vector<FitParameter>& all = h.declared->parameters;
  const model::Rig& rig = h.fitted->fit.machine.rig;
  const auto negative =
      std::find_if(all.begin(), all.end(), [&](const FitParameter& p) { return drives(p, rig); });
  if (negative == all.end()) return std::nullopt;
  const auto difference = std::find_if(all.begin(), all.end(), [&](const FitParameter& p) {
    return rig_file::servo_parameter(p.name).mean == negative->name;
  });
  return difference != all.end() ? *difference : *negative;
}

}  // namespace

Hypothesis hold_friction(const Hypothesis& before, const SearchContext& context) {
  const FitSettings& settings = context.settings.fit;
  Hypothesis h = before;
  while (const auto negative = negative_friction(h)) {
    const Hypothesis held = with_held(h, *negative, 0);
    if (h.effects.empty()) {
      h = held;
      h.fitted = std::make_shared<const BandFit>(fit_in_band(context.data, start_with(held, {}, context),
                                                             settings.cutoff, settings.tolerance, settings));
      continue;
    }
    auto with = refitted(held, held.effects, context);
    if (!with)
      throw CannotIdentify(negative->name + " comes out below 0, and with 0 the machine cannot be fitted");
    h = std::move(*with);
  }
  return h;
}

}  // namespace backlash::identification
