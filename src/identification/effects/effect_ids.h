// SPDX-License-Identifier: BSD-3-Clause
// Effects that the search treats in a way of their own.
#pragma once

namespace backlash {

constexpr const char* kLearnedMap = "learned_map";    // fitted by learned.h, not sought as a term
constexpr const char* kHardening = "mesh_hardening";  // may be teeth of another law
constexpr const char* kDelay = "delay";               // calibration is part of it
constexpr const char* kPresliding = "presliding";     // every friction has some

}  // namespace backlash
