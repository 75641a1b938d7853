// SPDX-License-Identifier: BSD-3-Clause
// A measured gap map as terms of the model: a rig whose backlash varies as the map says.
//
//   backlash(q) = b (1 + sum a_n sin(n q + p_n)),  b the mean gap, a_n = A_n / b      (term varying_backlash)
//
// The thesis (Yumrukcal 2013, Section 6.3) used the separation of the flanks in the constant-speed runs
// directly and found the gap too large by a nearly constant ratio. That separation is gap + 2 T_load / k: the
// load's friction winds the mesh up (gap_map.h). GapUse::directly is that use, for comparison.
#pragma once

#include "backlash_diagnosis/identification/procedures/gap_map.h"
#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/rig_file/rig_document.h"

namespace backlash::identification {

/// Which mean gap goes with the orders of the map.
enum class GapUse {
  corrected,  // the map's, less the wind-up where the map knows it
  directly,   // the map's, as the runs show it
  variation,  // the rig's own: A_n are the map's, b is not
};

/// The map with another mean gap, as a fit of the whole machine estimates it; the wind-up is the rest of the
/// separation. Where the machine was fitted with the orders of the map held, their errors are part of the
/// mean's: the fit takes it from the places that its records visit.
GapMap with_mean_gap(GapMap map, const signal::Measured& fitted);

/// Whether a term says how the backlash depends on the position of the load: varying_backlash, backlash_map.
bool gap_varies(const model::Rig& rig);

/// The rig (load side) with the orders of the map as terms varying_backlash instead of any that
/// gap_varies() asks for, and the mean gap as `use` says; the other terms stay. Throws InvalidParameter where
/// the mean is not > 0.
model::Rig with_gap_map(model::Rig rig, const GapMap& map, GapUse use = GapUse::corrected);

/// Puts one term varying_backlash per order of the map into a rig file, in place of those that
/// gap_varies() asks for. `mean_gap` [rad] is the backlash_angle of the document. Throws InvalidParameter
/// where it is not > 0, BadData where there are no such terms in block style.
void replace_gap_terms(rig_file::RigDocument& document, const GapMap& map, double mean_gap);

}  // namespace backlash::identification
