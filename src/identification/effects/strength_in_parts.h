// SPDX-License-Identifier: BSD-3-Clause
// Whether an effect is as strong in each part of the records as it is over all: slow and fast, here and
// there, early and late, and on the unseen record. What stands in for something else follows it where it was
// fitted, and not everywhere.
#pragma once

#include <optional>
#include <string>

#include "hypothesis.h"

namespace backlash::identification {

/// What some of the samples say, all else as fitted.
struct PartStrength {
  std::string part;                      // in words
  double ratio = 1, standard_error = 0;  // of the strength of the whole fit
};

/// The part that differs most, of those that differ clearly (BeliefSettings::least_constant); nothing where
/// the effect is the same in all, for maps and for the shape of friction, which has no strength.
std::optional<PartStrength> differing_part(const Hypothesis& h, std::size_t effect, const ServoData& unseen,
                                           const SearchContext& context);

}  // namespace backlash::identification
