// SPDX-License-Identifier: BSD-3-Clause
// Builds a monitoring curve: simulates the rig over a grid of backlash values, with several sensor noise
// seeds and sampling phases at each, and stores mean and scatter of the skewness.
//
// The motion is simulated once per backlash value, finer than the sampling; each seed then samples it at
// another phase between two samples (a recorder does not know where between its samples the excitation
// switches) and adds its own sensor noise. The same is done at several noise levels, so that a record can be
// compared with the curve at the noise that it has.
#pragma once

#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/diagnosis/monitoring_curve.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::studies {

struct CurveRequest {
  int points = 41;             // >= 2
  double max_backlash = 2e-4;  // m (angular mesh: rad), total free play, > 0
  double sampling_rate = 0;    // Hz; 0: the rig file's
  int periods = 10;            // per seed, after settling
  int seeds = 8;
  /// Drawn from what the rig file does not know, to learn how far answers may be off; 0: the machine is known
  /// to be the declared one.
  int machines = 64;
  BestSoFar best_so_far;  // points that are there; may be empty
};

/// Sampling rate [Hz] of a recorder whose samples are `interval` [s] apart, to four significant digits: the
/// rate it was set to, without the jitter of its stamps. Curves for records are built at this rate.
double nominal_sampling_rate(double interval);

/// Throws InvalidParameter (also where the rig declares no APD or an excitation without period),
/// IntegrationError, Cancelled. Uses all processors; the result does not depend on their number.
diagnosis::MonitoringCurve build_curve(const rig_file::RigFile& file, const CurveRequest& request,
                                       const Progress& progress = nullptr);

/// Warning about a curve that is used with a rig: empty, or that it was made from
/// another version of the rig file. Throws BadData naming `source` where it contradicts the geometry of the
/// rig.
std::string check_curve(const diagnosis::MonitoringCurve& curve, const rig_file::RigFile& rig,
                        const std::string& source);

}  // namespace backlash::studies
