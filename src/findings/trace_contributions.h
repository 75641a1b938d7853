// SPDX-License-Identifier: BSD-3-Clause
// What effects add to the motion of a record.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/identification/effects/effect_search.h"

namespace backlash::findings {

/// One sample per sample of the series: a torque on an end of the train, or how far a flank is moved away.
struct Contribution {
  std::string quantity, unit;
  std::vector<double> values;
};

/// Of some of the augmented rig's terms together. Only those that are not the same all the time; none of an
/// effect that only stiffens flanks or changes what sensors show.
std::vector<Contribution> contributions(const model::Rig& augmented, const std::vector<std::size_t>& terms,
                                        const identification::TraceSeries& series);

}  // namespace backlash::findings
