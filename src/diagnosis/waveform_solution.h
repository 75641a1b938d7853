// SPDX-License-Identifier: BSD-3-Clause
// The fit of a machine to the windows of a record, from many guesses to one answer with its error.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/waveform.h"
#include "waveform_fit.h"

namespace backlash::diagnosis {

/// What a channel leaves unexplained.
struct WaveformMisfit {
  double rms = 0;        // of the residual, unit of the channel
  double structure = 0;  // the same of its part that is surely no white noise
  double noise = 0;      // of the channel by itself, at most
  double swing = 0;      // of the channel
  double drive = 0;      // what noise of the torque that drives may leave
};

struct WaveformSolution {
  double half_gap = kNaN;       // m
  double log_error = kNaN;      // standard error of its logarithm
  std::vector<double> z;        // values in spreads from the declared ones
  std::vector<double> values;   // in their units
  double prior_cost = 0;        // chi^2 of all values but the gap, against what was known
  Eigen::MatrixXd covariance;   // of all values, in spreads; 0 where a value is not fitted
  Eigen::MatrixXd information;  // of those that are fitted, in their order, with what was known: its inverse
  std::vector<int> fitted;
  double wider = 1;  // -, times which the covariance is that inverse
  WaveformPriors priors;
  double common_scale = 0;
  double finest = kNaN;      // half width of the narrowest interval, in `unit`
  const char* unit = "m";    // of the gap
  std::vector<double> told;  // share of the prior spread that the record leaves, per value; 1: tells nothing
  WaveformMisfit misfit[kWaveformChannels];
  int windows = 0, left_out = 0, iterations = 0;
  double cost = 0;
  WaveformEvidence evidence;
  double rival = kNaN;       // m, half gap of the next best guess
  double rival_cost = kNaN;  // its cost more than that of the best, at the same stage
};

/// Throws Refusal where the record cannot be used.
/// `told`: half gap, m, by itself, with the standard deviation of its logarithm; NaN: not told.
/// `places`: as of waveform_windows().
WaveformSolution solve_waveform(const record::Record& record, const WaveformSettings& settings,
                                double told = kNaN, double told_error = kNaN,
                                const std::vector<double>& places = {});

/// Throws Refusal for a record without the channels, InvalidParameter for settings out of range.
void check_waveform(const record::Record& record, const WaveformSettings& settings);

/// Throws Refusal where the solution is not to be believed.
void refuse_waveform(const WaveformSolution& solution);

/// Name of a value for messages.
const char* waveform_value_name(int which);

}  // namespace backlash::diagnosis
