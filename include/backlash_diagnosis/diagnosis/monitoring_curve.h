// SPDX-License-Identifier: BSD-3-Clause
// Monitoring curve: skewness of the APD as a function of backlash, with its scatter and the conditions it
// holds for.
//
// At each backlash and each sensor noise level a number of simulated runs (seeds: other noise, other sampling
// phase) give skewness per period. The model of a record's mean over n periods is
//   mean(b)  +-  sqrt(between(b)^2 + within(b)^2 / n)
// `between` is what a run keeps from its seed (sampling phase, attractor), `within` what changes from period
// to period; both are standard deviations. After Sarkar, Ellis and Moore (1997), Section 9.1 and Fig. 10(f),
// who give no scatter.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/amplitude_distribution.h"
#include "backlash_diagnosis/diagnosis/apd_family.h"
#include "backlash_diagnosis/diagnosis/declared_spread.h"
#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/signal/noise.h"

namespace backlash::diagnosis {

/// All that a curve depends on. A record taken under other conditions is out of its domain.
struct CurveConditions {
  std::string rig;              // name in the rig file
  std::string rig_digest;       // of the rig file's text, to recognise a stale curve
  std::string version;          // of the package that made it
  std::string signal;           // channel name
  std::string excitation;       // type
  double amplitude = 0;         // N m, largest motor torque
  double excitation_level = 0;  // N m, median of |motor torque|: distinguishes a square wave from a sine
  double frequency = 0;         // Hz
  double sampling_rate = 0;     // Hz
  ApdLayout apd;
  int periods = 0, settling_periods = 0, seeds = 0;
  double noise = 0;         // N m (unit of the signal), declared for the sensor
  double motor_travel = 0;  // rad, largest range of motor_position over the whole curve
  bool output_locked = false;
  bool angular = false;  // a rig without base radius: backlash is an angle at the load [rad]
};

struct SkewnessCell {
  double mean = kNaN, between = 0, within = 0;
};

struct CurvePoint {
  double backlash = 0;              // m, total free play (angular mesh: rad)
  double signal_level = 0;          // median of |signal| at the declared noise
  bool monotonic = true;            // false: skewness rises here by more than its scatter explains
  std::vector<SkewnessCell> cells;  // one per noise level
};

class MonitoringCurve {
 public:
  CurveConditions conditions;
  std::vector<double> noise_levels;  // increasing, unit of the signal; contains conditions.noise
  std::vector<CurvePoint> points;    // increasing backlash
  std::optional<ApdFamily> family;   // at the same backlash values; for apd_shape
  /// Standard deviations within which 95 % of simulated records lie about the curve; normal by default.
  double coverage_factor = 1.959964;
  /// What the rig file leaves unknown of the machine; none if the file states it as known.
  std::optional<DeclaredSpread> spread;
  double backlash_to_angle = kNaN;  // rad (at the axis of motor_position) per unit of backlash

  /// Marks points that rise, and widens the scatter of all points from runs half way between them
  /// (middle[i][level] lies between points i and i + 1): by their own scatter, and by their distance from the
  /// straight line, which is structure that the grid does not resolve. Called once by the builder.
  void finish(const std::vector<std::vector<SkewnessCell>>& middle);

  /// Skewness model at any backlash within the curve and any noise (held constant outside the levels).
  SkewnessCell at(double backlash, double noise) const;

  /// Standard deviation of the mean skewness over `periods` periods.
  static double deviation(const SkewnessCell& cell, int periods);

  /// Whether skewness does not depend on backlash: at the declared noise no two points differ by more than
  /// the 95 % scatter of their runs. True of a signal that is commanded, like the current of an ideally
  /// controlled motor.
  bool flat() const;

  /// At the declared noise: what a plot of the curve shows.
  const SkewnessCell& nominal(const CurvePoint& point) const;

  /// Backlash values that explain a mean skewness over `periods` periods at the 95 % level, at any noise of
  /// the range (NaN: any that the curve covers), and the best of them at its upper end.
  ///   ok           the interval lies on the curve; where it is not monotonic the interval spans all branches
  ///   below_range  skewness is higher than at the smallest backlash: no interval
  ///   above_range  the largest backlash of the curve explains it, so may an even larger one; or it is lower
  ///                than anywhere on the curve: a lower bound only
  ///   ambiguous    the interval is longer than half of the curve; no upper bound where it reaches the end;
  ///   or the
  ///                curve is flat
  Estimate invert(double skewness, int periods, const signal::NoiseRange& noise) const;
  Estimate invert(double skewness, int periods, double noise) const {
    return invert(skewness, periods, {noise, noise});
  }

  std::string to_yaml() const;
  /// Throws BadData for a file that is no curve, has an unknown schema or breaks the rules above.
  static MonitoringCurve from_yaml(const YamlReader& yaml);
};

MonitoringCurve read_curve(const std::string& path);                      ///< MissingInput, BadData
void write_curve(const MonitoringCurve& curve, const std::string& path);  ///< CannotWrite

}  // namespace backlash::diagnosis
