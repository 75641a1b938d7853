// Where no named effect explains a residual: a smooth map over the coordinate that it follows best.
#pragma once

#include <optional>

#include "../joint_fit.h"
#include "backlash_diagnosis/identification/effect_search.h"

namespace backlash {

/// A learned_map term, and how much it explains of blocks that it was not fitted to.
struct LearnedCandidate {
  ParameterValues values;
  double smoothness = 0;  // weight of the squared second differences of `values`, in units of the rows
  double gain = 0;        // held out, relative decrease of the norm of all residuals
};

/// The maps over every coordinate, best first: values by least squares on what the machine's own parameters
/// leave, as smooth as cross-validation over blocks of the record says.
std::vector<LearnedCandidate> learn_maps(const MachineFit& fit, const RecordSet& records);

/// The machine with this map, whose values are fitted as well.
Machine with_map(Machine machine, const LearnedCandidate& candidate);

/// Rows that hold the map of `rig` at this place smooth.
Eigen::VectorXd smoothness_rows(const Rig& rig, std::size_t term, double smoothness);

}  // namespace backlash
