// SPDX-License-Identifier: BSD-3-Clause
// Effects of a user's own, beside those of src/model/terms.
#pragma once

#include "backlash_diagnosis/model/term.h"

namespace backlash::model {

/// Adds a term to the registry: it can then be read from rig files, simulated, fitted, searched for, and
/// reported as a change, as all others. To be called before anything else uses the registry: references to
/// types that were given out are no longer valid. Throws InvalidParameter where there is one of that id.
void register_term(TermType type);

}  // namespace backlash::model
