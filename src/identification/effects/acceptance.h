// SPDX-License-Identifier: BSD-3-Clause
// Whether an effect is believed.
#pragma once

#include <string>

#include "hypothesis.h"

namespace backlash::identification {

/// Sufficient gain if the residual is mostly noise, so that even a clear effect is a small part of it: a gain
/// that noise alone hardly ever reaches. Of n independent values of a channel noise gains sure^2 / (2 n).
double least_gain_in_noise(const RecordSet& records, const SearchSettings& settings);

/// Why `gain`, of a machine fitted to these records, is not sufficient; empty if it is.
std::string objection(const Gain& gain, const Machine& after, const RecordSet& records,
                      const SearchSettings& settings);

}  // namespace backlash::identification
