// SPDX-License-Identifier: BSD-3-Clause
// The reversals of the motor's torque in a record, and the windows about them. Samples count at the times at
// which they were taken (record/even_grid.h): one that is lost is a row that is not there.
#pragma once

#include <vector>

#include "backlash_diagnosis/record/record.h"
#include "waveform_motion.h"

namespace backlash::diagnosis {

/// The measured signals, and the reversals about which they are fitted.
struct WaveformData {
  std::vector<double> time, drive, torque, position;  // s, N m, N m, rad; no position: torque alone
  double interval = 0;                                // s, usual, between samples
  double level = 0;                                   // N m, usual torque of the motor
  bool square = true;                                 // it is a square wave, else its samples drive
  std::vector<WaveformWindow> windows;
};

struct WaveformCut {
  double ring = 0;          ///< s, cycle of the motor against the pinion: sets the scale of all times
  int most = 0;             ///< windows, spread evenly over the record
  bool free = false;        ///< the link is, so that a smooth torque turns on the teeth at another time
  double from = 0, to = 0;  ///< s, within which windows lie; the rest shows when a square wave reverses
};

/// A window that lacks half of its samples is left out. Throws Refusal where the samples are too few.
WaveformData waveform_data(const record::Record& record, const WaveformCut& cut);

/// How many samples a stage of the fit sees that looks `rings` cycles beyond the reversal.
std::size_t waveform_length(const WaveformWindow& window, double rings, double ring);

}  // namespace backlash::diagnosis
