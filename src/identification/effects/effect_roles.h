// SPDX-License-Identifier: BSD-3-Clause
// What the term of an effect is for the search, as its type says (model/term.h).
#pragma once

#include <string>

namespace backlash::identification {

/// Its law is learned from the records.
bool is_learned(const std::string& id);
/// Calibration of the delay is part of it.
bool is_delay(const std::string& id);
/// Beside the declared teeth it does what teeth of another law would do alone.
bool stands_in_for_contact_law(const std::string& id);
/// Every machine's friction has some of it.
bool shapes_friction(const std::string& id);

}  // namespace backlash::identification
