// SPDX-License-Identifier: BSD-3-Clause
// Whether an effect is believed.
#pragma once

#include <string>

#include "hypothesis.h"

namespace backlash::identification {

/// Gain that is enough in a residual that is mostly noise, where a clear effect is a small part of it: as
/// much as noise itself hardly ever gains. Of n independent values of a channel noise gains sure^2 / (2 n).
double least_gain_in_noise(const RecordSet& records, const SearchSettings& settings);

/// Why `gain`, of a machine that was fitted to these records, does not convince; empty where it does.
std::string objection(const Gain& gain, const Machine& after, const RecordSet& records,
                      const SearchSettings& settings);

}  // namespace backlash::identification
