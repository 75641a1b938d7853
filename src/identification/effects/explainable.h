// SPDX-License-Identifier: BSD-3-Clause
// How much of what a model leaves still follows the state of the machine, whatever the law: an upper bound of
// what any further effect can explain, and so of the noise.
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

/// What one state, or all of them together, say of the residual.
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
  std::vector<Follows> follows;  // each state alone, the one that says most first; none: too few samples
  /// Of 20 parts of the records, the largest sum of squares over their mean: noise that does not change is
  /// about the same everywhere.
  double unevenness = 0;
};

/// What is left, measured minus predicted, differs by as much from one time to the next where the motion
/// repeats; else 0.
double repeated_noise(const Predicted& record, bool deflection);

/// Of all samples that count. Too few (least_samples) say how much is left, and not what it follows. States:
/// position (and the strongest orders of it), velocity, acceleration, transmitted torque and path since the
/// last reversal, all of them as the model has them, and time. The measured torque is none of them: it holds
/// its own noise.
Remainder remainder(const std::vector<Predicted>& records, bool deflection, double cutoff,
                    const ExplainableSettings& settings);

}  // namespace backlash::identification
