// SPDX-License-Identifier: BSD-3-Clause
// What the estimates are worth: many simulated records of known backlash, diagnosed and counted.
//
// Every record is of a machine of its own, drawn from what the rig file knows of its values: friction,
// inertias, stiffnesses, damping, contact, gain and lag of the sensor, by the spreads of
// diagnosis/waveform.h or those of the file (of a rig that waveform does not describe: the stiffness of the
// couplings). It has its own backlash (uniform from 0 to the largest of the request), sensor noise (one of
// the given levels), number of periods and start within an excitation period, all drawn from one seed. Each
// is diagnosed twice: with all channels, and from the signal of the APD and
// motor_torque alone; records under wrong conditions from that signal alone.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::studies {

struct StudyRequest {
  int records = 600;           // >= 1
  double max_backlash = 2e-4;  // m (angular mesh: rad), > 0
  double sampling_rate = 0;    // Hz; 0: the rig file's. The curve must have been made for it.
  int fewest_periods = 5, most_periods = 20;
  std::vector<double> noise = {0.005, 0.01, 0.02, 0.05, 0.1, 0.2};  // of the signal's rms, >= 0
  std::uint64_t seed = 1;
  bool waveform = false;  // the estimator that takes seconds a record
};

/// The same file with each uncertainty of diagnosis.waveform times `share`, > 0: a machine that is known
/// better. Throws InvalidParameter for another share and where the rig has none.
rig_file::RigFile known_to(rig_file::RigFile file, double share);

/// One record and what was said about it. The last estimate, "combined", is that of the verdict.
struct StudyTrial {
  std::string variant;  // what was done to the conditions; empty in the study itself
  double backlash = 0;  // m, true
  double noise = 0;     // of the signal's rms
  int periods = 0;
  bool position = true;  // false: without positions
  std::vector<diagnosis::Estimate> estimates;
};

/// Throws InvalidParameter, IntegrationError, Cancelled. Deterministic for a seed, on any number of
/// processors.
std::vector<StudyTrial> run_study(const rig_file::RigFile& file, const diagnosis::MonitoringCurve& curve,
                                  const StudyRequest& request, const Progress& progress = nullptr);

/// Results of a method over a group of trials.
struct StudyRow {
  std::string method;
  int trials = 0, answered = 0;                  // answered: status ok
  double median_error = kNaN, p95_error = kNaN;  // m, of |estimate - truth|, where answered
  double median_width = kNaN;                    // m, of the interval, where answered
  double coverage = kNaN;                        // share of intervals that contain the truth, where answered
  int wrong_and_sure = 0;  // answered, and the truth outside of the interval by more than twice its width, or
                           // by more than 10 um and a fifth of the truth
  double cannot_tell = kNaN;  // share of trials without status ok
};

/// One row per method, for the trials with (or without) position, half gaps up to `max_half_gap` and a noise
/// of `noise` (NaN: any).
std::vector<StudyRow> summarise_study(const std::vector<StudyTrial>& trials, bool position,
                                      double max_half_gap, double noise = kNaN);

/// Records that were not taken under the conditions of the curve: amplitude, frequency, sampling, saturation,
/// free output, constant torque, too short, above the range; `records` of each, with random backlash.
std::vector<StudyTrial> run_variants(const rig_file::RigFile& file, const diagnosis::MonitoringCurve& curve,
                                     const StudyRequest& request, int records,
                                     const Progress& progress = nullptr);

/// What a method made of a variant: recognised (a status other than ok), answered rightly (ok, and the truth
/// within the interval or one width of it: some variants do no harm) or wrongly.
struct VariantRow {
  std::string variant, method;
  bool position = true;
  int recognised = 0, right = 0, wrong = 0;
};
std::vector<VariantRow> summarise_variants(const std::vector<StudyTrial>& trials);

}  // namespace backlash::studies
