// SPDX-License-Identifier: BSD-3-Clause
// A term as it stands in a rig file: how a program writes what read_term() reads.
#pragma once

#include <string>

#include "backlash_diagnosis/model/term.h"

namespace backlash::model {

/// One entry of `terms:` in YAML block style, indented by two, each key with its unit as comment:
///   - id: gravity
///     amplitude: 2.5  # N m
///     phase: 0.3  # rad
/// Numbers are the shortest that read back as the same double. For a term of make_term() or read_term().
std::string term_text(const Term& term);

}  // namespace backlash::model
