// SPDX-License-Identifier: BSD-3-Clause
// What a trace of an arm gives: a candidate in words and values, the rig with the effect, the series before
// and after, the noise.
#pragma once

#include <vector>

#include "fit_model.h"
#include "trace_evidence.h"

namespace backlash::arm {

std::vector<FittedMotion> as_fitted(const Motions& motions, bool marked);

/// Values of an effect with their standard errors; of a wave amplitude and phase.
std::vector<ArmParameter> effect_parameters(const FittedEffect& fitted);

/// A candidate that is reported: the last of its effects of a joint, else what it adds to the chain; values
/// of a fit that has it, and what was found after it. `law`: the share to which effects of joints are known.
ArmStep step_of(const Candidate& c, const ArmFit& fit, const ArmRig& rig, double law);

/// The rig with what the candidate adds to it.
ArmRig augmented_rig(const ArmRig& rig, const Candidate& taken);

/// Torques or currents of the base machine, and with the effect. `marked`: of another day than the training.
ArmTrace::Series series_of(const Motions& judged, const ArmFit& base, const FitFreedom& freedom,
                           const ArmFit& fit, bool marked);

/// The record as it is: nothing predicts a joint at rest.
ArmTrace::Series held_series(const ArmRecord& record, record::Channel channel);

/// Noise over the signal's standard deviation, per joint; NaN where `errors` is.
std::vector<double> noise_floors(const Motions& judged, const std::vector<double>& errors);

}  // namespace backlash::arm
