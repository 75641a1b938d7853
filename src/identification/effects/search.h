// SPDX-License-Identifier: BSD-3-Clause
// The search for missing effects: its steps in their order.
#pragma once

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/progress.h"
#include "hypothesis.h"

namespace backlash::identification {

struct SearchResult {
  Hypothesis declared;  // the machine as it is declared
  Hypothesis found;
};

/// Searched in `data`, believed where `unseen` bears it out. The same for the same records and settings.
/// `settings.fit` has its bands. `data` must outlive the result. Throws CannotIdentify, Cancelled.
SearchResult search_effects(const model::Rig& declared, const std::vector<ServoData>& data,
                            const ServoData& unseen, const SearchSettings& settings,
                            const Progress& progress);

/// What the terms of this id change of the signal, of the channel where that is more.
double share_of_signal(const Hypothesis& h, const std::string& id);

}  // namespace backlash::identification
