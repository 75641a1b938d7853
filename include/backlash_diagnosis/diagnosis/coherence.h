// SPDX-License-Identifier: BSD-3-Clause
// Coherence between torque and acceleration under random torque, as a detector of play (idea: Dagalakis and
// Myers, cited by Sarkar, Ellis and Moore 1997, Section 2). It shows whether the machine answers linearly,
// not how much play there is; friction, a contact that opens and any other nonlinearity lower it as play
// does, noise too.
//
//   gamma^2(f) = |Sxy|^2 / (Sxx Syy),   0 <= gamma^2 <= 1
//
// by Welch's method (1967): Hann windows, 50 % overlap, mean removed per segment. K such segments are worth
// n = K / (1 + 2 (1/6)^2) independent ones. For n averages (Carter, Knapp and Nuttall 1973; Bendat and
// Piersol):
//   bias         E[estimate] - gamma^2 = (1 - gamma^2)^2 / n, 1/n where there is none
//   variance     2 gamma^2 (1 - gamma^2)^2 / n
//   significance 1 - 0.05^(1/(n - 1)): passed by chance once in twenty where there is no coherence
// Linear system with response noise: gamma^2 = S / (S + N).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::diagnosis {

struct CoherenceSpectrum {
  std::vector<double> frequency;    ///< Hz, from one line above 0 to one line below half of the sampling rate
  std::vector<double> coherence;    ///< gamma^2, not corrected for bias; 0 where one signal has no power
  std::vector<double> input_power;  ///< unit of x squared per Hz, one-sided
  double averages = 0;              ///< n
  double significance = 1;          ///< 95 %
};

/// Coherence of two signals sampled at `rate` [Hz] with segments of `segment` samples (>= 8, even). Throws
/// InvalidParameter for a segment out of range, columns of different length or fewer than two segments.
CoherenceSpectrum estimate_coherence(const std::vector<double>& x, const std::vector<double>& y, double rate,
                                     std::size_t segment);

/// Mean loss of coherence of the healthy machine, from detect_nonlinearity() on its record.
struct CoherenceBaseline {
  double loss = 0;                    ///< -, mean of 1 - gamma^2
  double deviation = 0;               ///< standard deviation of loss
  double lower = kNaN, upper = kNaN;  ///< Hz, its band, in which other losses compare with it; NaN: any
};

struct CoherenceSettings {
  record::Channel response =
      record::Channel::motor_velocity;  ///< positions are differenced twice, velocities once, torques not
  double segment = 0;                   ///< s, > 0: resolution is two lines of 1 / segment
  /// Hz, band to look at; NaN: that of the baseline, else what holds 98 % of the torque's power.
  double lower = kNaN, upper = kNaN;
  /// Least growth of the loss over the baseline that counts as a finding, > 0. Below it a machine is left
  /// alone however certain the growth is.
  double least_growth = 0.02;
  std::optional<CoherenceBaseline> baseline;
};

/// What the detector found.
struct CoherenceDetection {
  Status status = Status::insufficient_data;
  double loss = kNaN;                             ///< mean of 1 - gamma^2 over the band, bias corrected
  double deviation = kNaN;                        ///< its standard deviation
  double index = kNaN;                            ///< growth of loss over the baseline, NaN without
  double index_lower = kNaN, index_upper = kNaN;  ///< 95 % interval
  std::optional<bool> nonlinear;                  ///< play or another nonlinearity seen; nothing: cannot tell
  double lower = kNaN, upper = kNaN;              ///< Hz, band used
  CoherenceSpectrum spectrum;
  std::string message;
};

/// Throws InvalidParameter for settings outside the ranges above. Answers by status:
///   insufficient_data  a channel is missing or the record holds fewer than 16 segments' worth of averages
///   out_of_domain      torque is not broadband and random (square wave, few lines, narrow band); it repeats,
///                      so that any response repeats with it and is coherent; samples not equidistant
///   ambiguous          with a baseline: the interval of the index holds least_growth
///   ok                 else; `nonlinear` only with a baseline
CoherenceDetection detect_nonlinearity(const record::Record& record, const CoherenceSettings& settings);

}  // namespace backlash::diagnosis
