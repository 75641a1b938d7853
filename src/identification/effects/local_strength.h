// SPDX-License-Identifier: BSD-3-Clause
// Whether an effect is as strong where it acts most as it is over all. A term that stands in for another
// follows it over the whole record, and not where it matters (a test for constant parameters, Chow 1960).
#pragma once

#include <optional>

#include "hypothesis.h"

namespace backlash::identification {

/// Strength as shown by the samples at which the effect acts most, over that of the whole fit.
struct LocalStrength {
  double ratio = 1, standard_error = 0;
};

/// By a linear step from the fit; parameters of the machine and of other effects are free, shapes of terms
/// are not. Of an effect with one term; nothing for several and for maps. `judged`: strength as
/// fitted; what its error is larger than that of independent rows this one is as well.
std::optional<LocalStrength> local_strength(const Hypothesis& h, std::size_t effect,
                                            const signal::Measured& judged);

}  // namespace backlash::identification
