// SPDX-License-Identifier: BSD-3-Clause
// What every machine has some of, and no rig file states: how friction builds up after a reversal, a torque
// whose zero is not quite zero.
#include <cmath>

#include "steps.h"

namespace backlash::identification {

double usual_strength(const model::TermType& type, const model::Rig& rig) {
  return type.usual_of_friction * rig.motor.coulomb_friction +
         type.usual_of_gap * rig.mesh.backlash / rig.mesh.lever();
}

bool is_usual(const Candidate& candidate, const model::Rig& rig) {
  const model::TermType& type = model::term_type(candidate.id);
  return type.search && candidate.terms.size() == 1 &&
         std::fabs(candidate.terms.front().at(type.search->strength)) <= usual_strength(type, rig);
}

}  // namespace backlash::identification
