// SPDX-License-Identifier: BSD-3-Clause
// Frequency response from motor torque to speed, from records (Yumrukcal 2013, Sections 2.4 and 5.3.2).
//
//   H(f) = speed / motor torque, rad/s per N m, for exp(+j 2 pi f t); an inertia J alone has 1/(j w J)
//
// Two estimators, chosen by what the torque is:
//   stepped sine  one sine at a time; least squares at the line of each (stepped_sine.h)
//   broadband     anything else that moves (chirp, random, square wave, closed-loop multi-sine): Welch's
//                 average H1 = S_uy / S_uu, Hann windows, 50 % overlap, so that noise of the speed averages
//                 out while noise of the torque lowers H by its share of the power at the line. A torque
//                 that answers to the measured speed (closed loop) biases H where the noise dominates. The
//                 resolution is two lines of 1/segment: a resonance needs a width beyond that.
//                 Standard error from coherence g^2 and n = K / (1 + 2/36) independent segments (Bendat and
//                 Piersol, Random Data, Table 9.6): of |H| relative and of the phase in rad
//                   sqrt((1 - g^2) / (2 n g^2))
//                 A line that stands alone (square wave, multi-sine) is given at its own frequency,
//                 interpolated between lines.
//
// What sampling every T does to the response is taken out, x = w T / 2:
//   * speed by central difference of a position: gain sin(2 x) / (2 x)
//   * torque that is held from sample to sample (`held`) acts half a sample later, exp(-j x), with gain
//     sin(x) / x. Images of the hold alias back into a motor speed: an inertia then shows x / sin(x) instead
//     (from positions cos(x)^2 x / sin(x)). The difference is taken off for the inertia that the upper half
//     of the points tends to, w |H| = (1 + d / f^2) / J; so they should reach beyond all resonances.
//
// Coulomb friction makes the response depend on amplitude where the speed changes sign: such points are
// marked, runs with a bias that keeps the sign are to be preferred.
#pragma once

#include <complex>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

struct ResponsePoint {
  double frequency = 0;           // Hz
  std::complex<double> response;  // rad/s per N m
  double coherence = 0;           // 0 to 1: share of the speed's power that belongs to the torque
  double standard_error = 0;      // relative, of |H|; the same in rad for the phase
  bool reverses = false;          // the speed has both signs
};

struct FrequencyResponse {
  std::vector<ResponsePoint> points;  // by rising frequency
  /// Neighbouring lines of one spectrum share their noise: the variance of whatever is fitted over many lines
  /// grows by this factor (1: independent points; 1 + 2 (4/9 + 1/36) with Hann windows).
  double variance_factor = 1;
};

struct ResponseSettings {
  bool held = false;             // motor_torque[k] acts from sample k to k + 1; false: instantaneous value
  double least_coherence = 0.5;  // points below are dropped
};

/// Of the motor's speed: velocity if recorded, else from position. Points with coherence >= least_coherence
/// below a quarter of the sampling rate. Throws CannotIdentify where a column is missing or not finite, the
/// torque does not vary, the record is too short, or no point is left; BadData for gaps in time;
/// InvalidParameter for a least_coherence outside 0 to 1.
FrequencyResponse estimate_response(const record::Record& record, const ResponseSettings& settings = {});

}  // namespace backlash::identification
