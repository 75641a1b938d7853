// SPDX-License-Identifier: BSD-3-Clause
// How a machine is fitted to records: one set of settings for all that fit.
#pragma once

#include <cstdint>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/fit/servo_data.h"

namespace backlash::identification {

/// Each value with its unit and its origin: theory, simulation (tried on simulated machines whose truth is
/// known) or choice (what is asked for, or the time that a fit may take).
struct FitSettings {
  // Bands. 0: from the machine, see with_bands().
  double cutoff = 0;        // Hz, low-pass of both residuals
  double rough_cutoff = 0;  // Hz, the same of the first fits: slow motion has fewer wrong minima
  double feedback = 0;      // 1/s, draws the simulated load to the recorded one (driven_load.h)

  // Starts of the first fit.
  int other_starts = 8;        // choice (time): beside the given one, at most
  double start_spread = 0.4;   // simulation: of the logarithm of a parameter > 0, to either side
  std::uint64_t seed = 1;      // choice
  double at_floor = 2;         // simulation: times the noise floor; less, and no other start is tried
  double same_minimum = 0.03;  // choice: relative difference of what two starts leave in the same minimum

  // Levenberg-Marquardt.
  int iterations = 20;            // choice (time)
  int iterations_of_map = 3;      // simulation: in the many values of a map the residuals are nearly linear
  double step = 1e-3;             // theory: forward differences, above the noise of the simulated load
  double rough_tolerance = 1e-3;  // choice: relative, of all fits but the last
  double tolerance = 1e-6;        // choice: relative, of the last
  double wide_step = 1e-2;     // simulation: the same of the last, to both sides: its errors come from them
  int renewals = 5;            // choice (time): of the weights, where a fit has changed them by more than
  double same_weights = 0.05;  // simulation: relative

  double calibration_delay = 3;  // choice: samples; a longer delay of the torque is no calibration
};

/// The settings with the bands that this machine and its records need, where they are 0. With f the frequency
/// of the mesh resonance (mesh_resonance.h), and no more than 0.2 of the sampling rate:
///   cutoff 1.36 f, rough cutoff 0.34 f, feedback 0.18 (2 pi f).
/// Without a load that moves freely: cutoff is the bandwidth of the motion, and at least 100 periods of it
/// are in the records. Throws CannotIdentify for records in which nothing moves.
FitSettings with_bands(FitSettings settings, const model::Rig& rig, const std::vector<ServoData>& data);

}  // namespace backlash::identification
