// SPDX-License-Identifier: BSD-3-Clause
// Description of an unexplained residual: channel, size, and the state that it follows.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/identification/effects/effect_search.h"
#include "explainable.h"

namespace backlash::identification {

/// What is left of a channel of some records ("", " on the unseen record").
struct ChannelRemainder {
  std::string channel, where;
  Remainder left;
};

/// The part that is explainable, as a share of the signal.
double explainable_part(const Remainder& left);

/// Of the remainder of which most is explainable, where that matters; else of one that is beyond the noise of
/// the sensors and comes and goes, which noise does not. None otherwise: what is left is noise.
std::optional<Unexplained> signature(const std::vector<ChannelRemainder>& all, bool linear,
                                     const ExplainableSettings& settings);

/// What is beyond the noise of the sensors and follows nothing.
std::vector<std::string> noise_notes(const std::vector<ChannelRemainder>& all,
                                     const ExplainableSettings& settings);

}  // namespace backlash::identification
