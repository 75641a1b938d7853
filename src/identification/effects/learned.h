// SPDX-License-Identifier: BSD-3-Clause
// Where no named effect explains a residual: a smooth map over the coordinate that it follows best.
#pragma once

#include "../fit/joint_fit.h"
#include "backlash_diagnosis/model/term.h"
#include "search_settings.h"

namespace backlash::identification {

/// The values of a map_term(), and how much it explains of blocks that it was not fitted to.
struct LearnedCandidate {
  ParameterValues values;
  double smoothness = 0;  // weight of the squared second differences of its values, in units of the rows
  double gain = 0;        // held out: relative decrease of the norm of all residuals
};

/// The term whose law is learned.
const model::TermType& map_term();

/// What the values of a learned map are and follow. Throws InvalidParameter for a kind that is never learned.
const model::MapKind& kind_of(const ParameterValues& values);

/// A map over every coordinate, best first: values by least squares on what the machine's own parameters
/// leave, as smooth as cross-validation over blocks of the records says.
std::vector<LearnedCandidate> learn_maps(const MachineFit& fit, const RecordSet& records,
                                         const model::MotionRange& range, const MapSettings& settings);

/// The machine with this map, whose values are fitted as well, held as smooth as they are.
Machine with_map(Machine machine, const LearnedCandidate& candidate, const model::MotionRange& range,
                 const MapSettings& settings);

}  // namespace backlash::identification
