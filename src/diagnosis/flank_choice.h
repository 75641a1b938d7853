// SPDX-License-Identifier: BSD-3-Clause
// Two flanks of a joint whose load moves, read in several ways: over short or long windows, by the recorded
// torque or by the torque that the motion takes, with one law or another of deflection over torque. The way
// with the smallest error is taken; laws that the record does not distinguish widen the interval.
#pragma once

#include "backlash_diagnosis/diagnosis/flank_fit.h"

namespace backlash::diagnosis {

/// Student t times the standard error, 95 %: two stays make one pair of flanks.
double scatter_of(const FlankFit& fit);

/// rad: scatter, what noise of the torque may hide, and a share of the residual.
double error_of(const FlankFit& fit);

/// Of the rms residual, which the fit counts as an error of the play. Choice, tried on simulated machines.
constexpr double kResidualShare = 0.3;

struct FlankReading {
  FlankFit fit;
  double windows_change = 0;  // rad, change of the gap with windows twice (or half) as long
  double another_gap =
      0;  // rad, by windows or a torque whose gap differs from that of `fit` by more than the errors
  double least = 0, largest = 0;  // rad, play by any law of the deflection that the record does not rule out
  bool declared_law = true;
  // How it was read.
  std::size_t half_window = 0;
  bool balanced = false;
  FlankWindows windows;
  FlankModel model;
};

/// `large_torque` [N m] > 0: where the laws of the deflection give the same. `fit.found` is false where no
/// way shows two flanks.
FlankReading read_flanks(const TwoEncoders& motion, const FlankModel& model, double large_torque);

/// Another motion of the same length, or the same with another skew, read in the same way.
FlankFit read_again(const TwoEncoders& motion, const FlankReading& reading);

/// Windows number `begin` to `end` alone.
FlankWindows part_of(const FlankWindows& windows, std::size_t begin, std::size_t end);

}  // namespace backlash::diagnosis
