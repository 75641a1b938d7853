// SPDX-License-Identifier: BSD-3-Clause
// Widens the intervals of a curve by machines that the rig file allows.
#pragma once

#include "fine_run.h"

namespace backlash::studies {

/// Runs that learn_spread() makes; 0 of a rig whose uncertainties nobody declares (no diagnosis.waveform).
long spread_runs(const CurvePlan& plan);

/// Diagnoses records of drawn machines with a curve that is complete but for its spread. A rig with
/// spread_runs() > 0.
diagnosis::DeclaredSpread learn_spread(const CurvePlan& plan, const diagnosis::MonitoringCurve& curve,
                                       Ticker& ticker);

}  // namespace backlash::studies
