// SPDX-License-Identifier: BSD-3-Clause
// Backlash as a function of load position, from one run at constant speed each way (Yumrukcal 2013,
// Section 5.4).
//
// Each run presses one flank; with motor minus load position d, load position q, forward means d rises with
// load:
//   d_f(q) = s q + m(q) + g(q)/2 + T_f/k,   d_r(q) = s q + m(q) - g(q)/2 - T_r/k
//   separation d_f - d_r = g + (T_f + T_r)/k,   mean of both - s q = m + (T_f - T_r)/(2k)
// g the gap [rad], m the centre line (transmission error, eccentricity, zero of the sensors), s the scale
// error of the motor's position, averaged over both directions as the thesis does. The load's friction T [N
// m] at the speed of the run winds the mesh up by T/k: without this correction the gap is too large, by 20 %
// in configuration 1 of the thesis (friction system minus driver), which is what its unexplained ratio of
// Section 6.3 looks like. The series is g(q) = mean + sum A_n sin(n q + phi_n). Orders are taken one after
// the other while an F-test (2 parameters, Bonferroni over the orders that are left) finds them at
// `false_alarm`.
//
// What turns with another part than the load, as the pinion, is no series over a turn of it: trace_residual
// finds its order.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/procedures/harmonics.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

struct GapMapSettings {
  signal::Measured stiffness;  // N m/rad; NaN: no correction of the wind-up
  signal::Measured friction_forward,
      friction_reverse;       // N m, of the load, both > 0, at the speed of the runs
  int bins = 180;             // per turn, 8 to 3600
  int highest_order = 20;     // 0 to bins / 4
  double false_alarm = 0.01;  // of "the gap varies", 1e-6 to 0.5
};

/// Values at the middle of the bin; standard errors from the scatter inside, its correlation in time
/// considered.
struct GapBin {
  double position;  // rad, load, 0 to 2 pi
  int forward_samples, reverse_samples;
  signal::Measured forward, reverse;  // rad, motor minus load, less s q and the mean of both runs
  signal::Measured separation;        // rad, forward minus reverse, not corrected
  signal::Measured centre;            // rad, mean of both
};

struct GapMap {
  std::vector<GapBin> bins;            // by position, those that both runs visited
  double coverage = 0;                 // of the turn, that these are
  signal::Measured mean_separation;    // rad, equal weight for equal angles, not for equal times
  signal::Measured wind_up, mean_gap;  // rad; NaN where stiffness or friction is not given
  signal::Measured scale_forward, scale_reverse, scale;  // motor travel per load travel of the runs, and mean
  double forward_speed = 0, reverse_speed = 0;           // rad/s, of the load, medians
  std::vector<Harmonic> harmonics;                       // by order, those above a thousandth of the mean
  double deviation = 0;                                  // rad, of the bins from the series
  bool varies = false;
  double confidence = 0;  // that it varies: 1 - chance of the strongest harmonic
  std::string statement;  // the same in words
  std::vector<std::string> warnings;

  /// Series with the corrected mean where known, else the separation's [rad].
  double gap_at(double position) const;
};

/// The runs in either order, with the same zeros of the sensors. While the load gains or loses speed its
/// inertia winds the mesh up as well: of each run the start and the end are left out while the speed (below 5
/// Hz) is not as steady as in the middle (a quarter of the run at most each), and samples beyond 5 % of its
/// median. With less than a turn orders below 1 / coverage are not sought. Throws CannotIdentify without the
/// channels, where both runs go one way, one reverses or is not steady for half of its time, or with fewer
/// than 8 common bins; InvalidParameter for settings.
GapMap identify_gap_map(const record::Record& one_way, const record::Record& other_way,
                        const GapMapSettings& settings = {});

}  // namespace backlash::identification
