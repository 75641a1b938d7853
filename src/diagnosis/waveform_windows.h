// SPDX-License-Identifier: BSD-3-Clause
// The reversals of the motor's torque in a record, and the windows about them.
#pragma once

#include <vector>

#include "backlash_diagnosis/record/even_grid.h"
#include "waveform_motion.h"

namespace backlash::diagnosis {

/// Of a torque that is no square wave, windows have its samples (`drive`). A window that lacks a tenth of
/// its samples, or one before its reversal, is left out; other lost samples do not count. Throws Refusal
/// where the samples are uneven or too few.
///   ring     s, cycle of the motor against the pinion: sets the scale of all times
///   longest  the most windows to return, spread evenly over the record
///   places   of the reversals of a square wave, in samples, as waveform_reversals() tells them from a longer
///            record; empty: told from this one
///   free     whether the link is, so that a smooth torque turns on the teeth at another time than at the
///   motor
std::vector<WaveformWindow> waveform_windows(const record::EvenGrid& even, double ring, int most, bool free,
                                             const std::vector<double>& places = {});

/// Where a square wave reverses, in samples, more finely than one where its period is steady. Throws Refusal
/// for a torque that never reverses.
std::vector<double> waveform_reversals(const record::EvenGrid& even);

/// Samples before the reversal, and after it for a stage of the fit that looks `rings` cycles far.
int waveform_lead(double ring, double interval);
int waveform_length(const WaveformWindow& window, double rings, double ring, double interval);

}  // namespace backlash::diagnosis
