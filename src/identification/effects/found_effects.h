// SPDX-License-Identifier: BSD-3-Clause
// The effects of a hypothesis as a report says them: parameters with standard errors, evidence, errors on the
// unseen record.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "hypothesis.h"

namespace backlash::identification {

/// Fitted values with standard errors: of the machine by name, of the effects in the order of their fitted
/// parameters.
struct FittedValues {
  std::map<std::string, signal::Measured> machine;
  std::vector<signal::Measured> effects;
};
/// How many values of the t-th term are fitted, the strength first.
std::size_t fitted_count(const Candidate& candidate, std::size_t t);

/// `declared`: how many of the first parameters are the machine's.
FittedValues fitted_values(const BandFit& fitted, std::size_t declared);
/// The errors of the machine's values where these nearly mix (fit/valley.h).
void allow_for_valley(FittedValues& values, const BandFit& fitted, const FitSettings& settings);

/// One step per effect; a second term of the same kind belongs to the step of the first. `on_test`: as
/// predicted_by_all() gives it.
std::vector<FoundEffect> found_effects(const Hypothesis& h, std::vector<signal::Measured> fitted,
                                       const std::vector<ServoPrediction>& on_test,
                                       const BeliefSettings& settings);

}  // namespace backlash::identification
