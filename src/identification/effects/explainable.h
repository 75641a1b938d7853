// SPDX-License-Identifier: BSD-3-Clause
// How much of a residual follows the state of the machine, by whatever law. This is an upper bound of what
// further effects can explain; the rest is noise.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/identification/fit/output_error.h"
#include "backlash_diagnosis/signal/block_regression.h"
#include "search_settings.h"

namespace backlash::identification {

/// A record and what a machine says of it.
struct Predicted {
  const ServoData* data;
  ServoPrediction prediction;
};

/// How much one state, or all of them together, predict of the residual.
struct Follows {
  std::string name;
  signal::PredictedShare share;
};

/// What is left of one channel.
struct Remainder {
  double rms = 0;        // N m or rad
  double floor = 0;      // the same unit: what the noise of the sensors leaves
  double signal = 0;     // the same unit: standard deviation of what was measured
  double explained = 0;  // the same unit: what the found effects of this channel took away; 0: none
  signal::PredictedShare explainable;
  std::vector<Follows> follows;  // each state alone, the best predictor first; empty: too few samples
  /// The largest sum of squares of 20 parts of the records over their mean: about 1 for noise that is the
  /// same everywhere.
  double unevenness = 0;
};

/// If the motion repeats, the standard deviation by which the residual differs between repetitions; else 0.
double repeated_noise(const Predicted& record, bool deflection);

/// From all samples that count; fewer than least_samples give the size of the residual only. States: position
/// (and its strongest orders), velocity, acceleration, transmitted torque and path since the last reversal,
/// all as the model predicts them, and time. The measured torque is not among them, as its noise is part of
/// the residual.
Remainder remainder(const std::vector<Predicted>& records, bool deflection, double cutoff,
                    const ExplainableSettings& settings);

}  // namespace backlash::identification
