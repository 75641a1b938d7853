// SPDX-License-Identifier: BSD-3-Clause
// Where a rig file holds the values that `waveform` fits.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/model/rig.h"

namespace backlash::rig_file {

struct KnownPlace {
  std::vector<std::string> path;
  model::Coupling model::Rig::*half = nullptr;  // the coupling whose inertia is shared
  model::Body model::Rig::*body = nullptr;      // or, where that is rigid, the body that moves along
};

/// In the order of diagnosis::waveform_quantities().
const std::vector<KnownPlace>& known_places();

/// What the value has of the inertia of others, kg m^2.
double shared_inertia(const KnownPlace& place, const model::Rig& rig);

}  // namespace backlash::rig_file
