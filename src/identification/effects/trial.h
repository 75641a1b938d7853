// SPDX-License-Identifier: BSD-3-Clause
// A candidate fitted together with the machine.
#pragma once

#include <optional>
#include <vector>

#include "hypothesis.h"

namespace backlash::identification {

struct Trial {
  Candidate candidate;  // as fitted
  Machine start;        // what fit.fit.values belong to
  MachineFit fit;
  double residual = 0;  // norm of all rows
};

/// Fits machine and candidate roughly, with the weights of the hypothesis, so that fits can be compared.
/// Nothing if the fit fails.
std::optional<Trial> tried(const Hypothesis& h, const Candidate& candidate, const SearchContext& context);

struct Trials {
  std::vector<Trial> fitted;             // best first; of those that tie the simplest
  std::vector<RejectedEffect> rejected;  // those that were not worth a fit, or could not be fitted
};
/// The most promising of the candidates, which come best first.
Trials tried_best(const Hypothesis& h, const std::vector<Candidate>& candidates,
                  const SearchContext& context);

/// Whether some of its orders are not fitted.
bool holds_orders(const Candidate& candidate);

/// An order that the travel does not resolve becomes the best whole number near its fitted value, unless the
/// fitted value leaves a clearly smaller residual.
Trial with_free_orders(const Hypothesis& h, const Trial& trial, const SearchContext& context);

}  // namespace backlash::identification
