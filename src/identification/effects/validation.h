// SPDX-License-Identifier: BSD-3-Clause
// Whether an effect helps where the fit has not seen the record.
#pragma once

#include "../fit/joint_fit.h"
#include "backlash_diagnosis/identification/effects/effect_search.h"
#include "search_settings.h"

namespace backlash::identification {

/// Norms of the residuals of one fit, each block of the records predicted by what the other blocks say
/// (linear about the fit).
struct HeldOut {
  std::vector<double> torque, deflection;  // squares, per block
  double torque_train = 0, deflection_train = 0;
};

/// Both fits to be compared must have the same weights.
HeldOut held_out(const MachineFit& fit, const RecordSet& records, const AcceptanceSettings& settings);

/// What the second fit has gained on the first, of the channel that gains most.
struct Gain {
  bool deflection = false;  // the channel
  Evidence evidence;
  double total = 0;  // held out, both channels together
};
Gain compare(const HeldOut& without, const HeldOut& with);

}  // namespace backlash::identification
