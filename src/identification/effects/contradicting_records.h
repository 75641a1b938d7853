// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "hypothesis.h"

namespace backlash::identification {

/// The declared machine fitted to each record alone: `context.data`, then `unseen`; `names` in that order.
/// `left`: times the noise, of all together. Nothing where they do not contradict each other, or where there
/// are too many to try.
std::optional<SeveralMachines> contradicting_records(const model::Rig& declared,
                                                     const std::vector<std::string>& names,
                                                     const ServoData& unseen, double left,
                                                     const SearchContext& context);

}  // namespace backlash::identification
