// SPDX-License-Identifier: BSD-3-Clause
// What every machine has some of, and no rig file states: how friction builds up after a reversal, a torque
// whose zero is not quite zero.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/simulation/driven_load.h"
#include "effect_roles.h"
#include "steps.h"

namespace backlash::identification {
namespace {

/// Half as strong as is usual, for a start; one per body where it has a choice.
std::vector<Candidate> usual_candidates(const model::TermType& type, const model::Rig& rig,
                                        const model::MotionRange& range) {
  ParameterValues values;
  for (const model::TermShape& shape : type.search->shapes) values[shape.name] = shape.values(range).front();
  values[type.search->strength] = 0.5 * usual_strength(type, rig);
  std::vector<Candidate> all = {{type.id, {values}}};
  for (const ParameterSpec& spec : type.parameters) {
    if (spec.choices.empty()) continue;
    std::vector<Candidate> more;
    for (const Candidate& c : all)
      for (const std::string& word : spec.choices)
        more.emplace_back(c).terms.front().set_choice(spec.name, word);
    all = std::move(more);
  }
  return all;
}

}  // namespace

double usual_strength(const model::TermType& type, const model::Rig& rig) {
  return type.usual_of_friction * rig.motor.coulomb_friction +
         type.usual_of_gap * rig.mesh.backlash / rig.mesh.lever();
}

bool is_usual(const Candidate& candidate, const model::Rig& rig) {
  const model::TermType& type = model::term_type(candidate.id);
  return type.search && candidate.terms.size() == 1 &&
         std::fabs(candidate.terms.front().at(type.search->strength)) <= usual_strength(type, rig);
}

Hypothesis add_shape_of_friction(const Hypothesis& before, const SearchContext& context) {
  Hypothesis h = before;
  const model::Rig& rig = h.declared->rig;
  if (!simulation::load_moves_freely(rig) || clearly_right(misfit(h), context)) return h;
  for (const model::TermType& type : model::term_types()) {
    if (!type.shapes_friction || !(usual_strength(type, rig) > 0)) continue;
    for (const Candidate& candidate : usual_candidates(type, rig, context.range)) {
      context.report("fit of how friction builds up");
      std::vector<Effect> effects = h.effects;
      effects.push_back({candidate, {}, {}, {}, {}});
      auto with = refitted(h, std::move(effects), context, Settled::roughly);
      if (!with || !is_usual(with->effects.back().candidate, rig) ||
          size(*with) >= (1 - context.settings.asked.least_gain) * size(h))
        continue;
      with = refitted(*with, with->effects, context);
      if (with) h = std::move(*with);
    }
  }
  return h;
}

}  // namespace backlash::identification
