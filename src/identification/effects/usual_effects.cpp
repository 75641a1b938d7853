// SPDX-License-Identifier: BSD-3-Clause
// What every machine has some of, and no rig file states: how friction builds up after a reversal, what teeth
// lose, a torque whose zero is not quite zero, or whose constant is not quite the declared one, which shows
// as more or less weight.
#include <cmath>

#include "backlash_diagnosis/model/weight_term.h"
#include "steps.h"

namespace backlash::identification {
namespace {

double declared_weight(const model::Rig& rig) {
  double weight = 0;
  for (const auto& term : rig.terms)
    if (term->id == model::weight_term())
      weight += std::fabs(term->values.at(model::term_type(term->id).search->strength));
  return weight;
}

/// Or none per turn at all.
bool is_one_wave_per_turn(const Candidate& candidate) {
  for (const model::TermShape& shape : model::term_type(candidate.id).search->shapes)
    if (shape.wave && candidate.terms.front().at(shape.name) != 1) return false;
  return true;
}

}  // namespace

/// Of the machine as it is found; of the weight as it is declared, as a found one is an effect.
bool is_usual(const Candidate& candidate, const Hypothesis& h) {
  const model::Rig& rig = h.fitted->fit.machine.rig;
  const model::TermType& type = model::term_type(candidate.id);
  if (!type.search || candidate.terms.size() != 1) return false;
  const double usual =
      type.usual_share + type.usual_of_friction * std::fmax(0, rig.motor.coulomb_friction) +
      type.usual_of_gap * rig.mesh.backlash / rig.mesh.lever() +
      (is_one_wave_per_turn(candidate) ? type.usual_of_weight * declared_weight(h.declared->rig) : 0);
  return std::fabs(candidate.terms.front().at(type.search->strength)) <= usual;
}

}  // namespace backlash::identification
