// SPDX-License-Identifier: BSD-3-Clause
// Whether a record is of one play, or of one that became another while it was taken.
#pragma once

#include <optional>
#include <string>

#include "backlash_diagnosis/diagnosis/diagnose.h"

namespace backlash::diagnosis {

/// By one method, the one that shows it most plainly.
struct PlayChange {
  std::string method;
  double from = kNaN, to = kNaN;       ///< s of the record, between which the play became another
  double before = kNaN, after = kNaN;  ///< m, or rad where the method knows no length
  bool angular = false;                ///< whether they are [rad]
};

/// Cuts the record into twelve stretches of the same length and lets the quick methods answer on each; where
/// none of them does, gap_traverse on each of four, as it needs many crossings. For every cut the means
/// before and after it are compared (a change at an unknown moment: Page 1955). The play is another one where
/// they differ by more than six standard errors, from the scatter of the answers about their means, not below
/// what they say of themselves (without declared values, which are the same in all), and by a tenth of the
/// larger. None: no method shows a change, or none answers on two stretches at least. Throws as diagnose()
/// does.
std::optional<PlayChange> play_change(const record::Record& record, const DiagnosisSettings& settings,
                                      const MonitoringCurve* curve);

/// "lost_motion 0.0001198 m before, 2.01e-05 m after"
std::string plays_text(const PlayChange& change);

}  // namespace backlash::diagnosis
