// SPDX-License-Identifier: BSD-3-Clause
// Predictions of a record that the search has not seen, before and after each effect.
#pragma once

#include <vector>

#include "hypothesis.h"

namespace backlash::identification {

/// Of a record that the machine was not fitted to. `settings` have their bands.
Calibration calibrated(Machine machine, const ServoData& record, const FitSettings& settings);

/// The prediction of a record that the machine was not fitted to, with the record's own calibration.
/// `settings` have their bands.
ServoPrediction predicted(const Machine& machine, const ServoData& record, const FitSettings& settings);

/// The machine before any effect, then with each effect and those before it.
std::vector<ServoPrediction> predicted_by_all(const Hypothesis& h, const ServoData& record,
                                              const FitSettings& settings);

/// Relative error of a channel over all training records, as fitted.
double train_error(const Machine& machine, const std::vector<ServoData>& data, const FitSettings& settings,
                   ChannelError ServoPrediction::*channel);

/// The record as two models have it.
TraceSeries trace_series(const ServoData& data, const ServoPrediction& before, const ServoPrediction& after);

/// Whether the residuals of both still follow torque or speed. `cutoff` [Hz] of the residuals.
std::vector<Independence> independence(const TraceSeries& series, const ServoData& data, double cutoff);

}  // namespace backlash::identification
