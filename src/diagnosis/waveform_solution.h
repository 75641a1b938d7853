// SPDX-License-Identifier: BSD-3-Clause
// The fit of a machine to the windows of a record, from many guesses to one answer with its error.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/waveform.h"
#include "waveform_residuals.h"

namespace backlash::diagnosis {

/// What a channel leaves unexplained.
struct WaveformMisfit {
  double rms = 0;        // of the residual, unit of the channel
  double structure = 0;  // the same for the part that is certainly not white noise
  double noise = 0;      // of the channel by itself, at most
  double swing = 0;      // of the channel
  double drive = 0;      // what noise of the torque that drives may leave

  /// The part that is neither noise of the channel nor of the driving torque.
  double left() const;
};

struct WaveformSolution {
  double half_gap = kNaN;      // m
  double log_error = kNaN;     // standard error of its logarithm, the larger of the fit's and of the windows'
  std::vector<double> z;       // values in spreads from the declared ones
  std::vector<double> pull;    // of what was known on each, in spreads
  std::vector<double> values;  // in their units
  double prior_cost = 0;       // chi^2 of all values but the gap, against what was known
  Eigen::MatrixXd covariance;  // of all values, in spreads; 0 where a value is not fitted
  Eigen::MatrixXd information;  // of those that are fitted, in their order, without what was known
  std::vector<int> fitted;
  double wider = 1;  // -, times which the covariance is that of the fit
  WaveformPriors priors;
  double finest = kNaN;                // half width of the narrowest interval, in `unit`
  const char* unit = "m";              // of the gap
  std::vector<double> left_of_spread;  // posterior over prior spread, per value
  WaveformMisfit misfit[kWaveformChannels];
  int windows = 0, left_out = 0;
  bool lacking = false;       // the rig file lacks something of the machine
  double foreign_torque = 0;  // N m, that it may hold without being seen, then
  double cost = 0;
  WaveformEvidence evidence;
  double rival = kNaN;       // m, half gap of the next best guess
  double rival_cost = kNaN;  // its cost more than that of the best, at the same stage

  bool position() const { return misfit[kPositionChannel].swing > 0; }
};

/// What of a record is fitted, and what is known of its play.
struct WaveformTask {
  double from = -1e300, to = 1e300;          ///< s
  double half_gap = kNaN, log_error = kNaN;  ///< m, standard deviation of the logarithm; NaN: nothing
};

/// Throws Refusal where the record cannot be used.
WaveformSolution solve_waveform(const record::Record& record, const WaveformSettings& settings,
                                const WaveformTask& task = {});

/// Throws Refusal for a record without the channels, InvalidParameter for settings out of range.
void check_waveform(const record::Record& record, const WaveformSettings& settings);

/// Throws Refusal where the solution is not to be believed.
void refuse_waveform(const WaveformSolution& solution);

}  // namespace backlash::diagnosis
