// SPDX-License-Identifier: BSD-3-Clause
// Clearance from external excitation: the motor braked, the load pushed to and fro by hand (Yumrukcal 2013,
// Section 5.3.1, who reads the load's travel while the motor stands).
//
// The flanks are elastic: the travel from one turning point to the other exceeds the gap by the deflection of
// both flanks, v / w each for an arrival at speed v, w = sqrt(k / J), plus what the hand presses. The push is
// not measured, but it is slow; where the load's deceleration starts is the flank. So every passage of the
// gap is fitted by the motion of the load, q relative to the motor, integrated twice:
//   q(t) = polynomial (start, and the push over J) - w^2 II p - 2 z w II p',
// II the double integral from the start of the passage, p the penetration of a flank (> 0 above the upper, <
// 0 below the lower) taken from the low-passed record. Linear but for the two flanks; w and z >= 0 are those
// of all passages. The gap is that at zero force. It is the mean of two fits, the push a parabola and a cubic
// in time; their difference is part of the standard error, for what the hand does is not known.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

struct ClearanceSettings {
  /// Both > 0: w = sqrt(stiffness / load_inertia) is held, which helps where flanks are touched for less than
  /// a quarter of a period of w; NaN: w is fitted.
  double stiffness = std::numeric_limits<double>::quiet_NaN();     // N m/rad
  double load_inertia = std::numeric_limits<double>::quiet_NaN();  // kg m^2
  // Of the travel in which passages are sought, and of the penetration. Simulation: of a load that rings on a
  // flank at 10 Hz; clearance_settings() has those of a machine.
  double cutoff = 40, fine_cutoff = 120;  // Hz
  double contact_time = 0.05;      // s, before and after the middle half of the travel, that are fitted
  double most_motor_travel = 0.1;  // of the load's travel in a passage: more is a motor that is not braked
  int least_passages = 3;
};

/// The settings of a machine: stiffness k [N m/rad] and load inertia J [kg m^2], both > 0, are held, and the
/// low-passes are 3.85 and 11.5 times sqrt(k / J) / 2 pi.
ClearanceSettings clearance_settings(double stiffness, double load_inertia);

/// One passage of the gap, from turning point to turning point.
struct GapPassage {
  std::vector<double> time, measured, fitted;  // s; rad, load minus motor
  double lower = 0, upper = 0;                 // rad, the flanks, in the same coordinate
  signal::Measured gap;                        // rad
  double travel = 0;                           // rad, of `measured`: gap and deflection
  double motor_travel = 0;                     // rad
  double speed = 0;                            // rad/s, fastest, signed
  double deviation = 0;                        // rad, of the residuals
};

struct Clearance {
  signal::Measured gap;          // rad, without force, over the passages
  signal::Measured travel;       // rad, mean of the travels: what the thesis reads
  double lower = 0, upper = 0;   // rad, the flanks, load minus motor
  double contact_frequency = 0;  // rad/s, w, as given or found (with the cubic, as all below and the flanks)
  double damping_ratio = 0;      // z, of the load on a flank
  std::vector<GapPassage> passages;
  int found = 0;  // passages, of which `passages` could be used
  std::vector<std::string> warnings;
};

/// Throws CannotIdentify without the two positions, where the motor is not braked, with fewer than
/// `least_passages` passages that fit or an error beyond a quarter of the gap; InvalidParameter for settings.
Clearance identify_clearance(const record::Record& record, const ClearanceSettings& settings = {});

}  // namespace backlash::identification
