// SPDX-License-Identifier: BSD-3-Clause
// Whether an effect is as strong where it acts most as over the whole record. A term that stands in for
// another one fits it on average, but not where it acts most (a test for constant parameters, Chow 1960).
#pragma once

#include <optional>

#include "hypothesis.h"

namespace backlash::identification {

/// Strength as shown by the samples at which the effect acts most, over that of the whole fit.
struct LocalStrength {
  double ratio = 1, standard_error = 0;
};

/// By one linear step from the fit, with the parameters of the machine and of other effects free and the
/// shapes of terms fixed. Only for an effect with one term; nothing for several terms and for maps. `judged`:
/// the strength as fitted. The factor by which its error exceeds that of independent rows is applied here
/// too.
std::optional<LocalStrength> local_strength(const Hypothesis& h, std::size_t effect,
                                            const signal::Measured& judged);

}  // namespace backlash::identification
