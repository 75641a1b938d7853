// SPDX-License-Identifier: BSD-3-Clause
// Friction from runs at constant speed: torque without acceleration is friction. Yumrukcal (2013), Sections
// 5.1.1 and 5.2.1: one straight line per direction, T_f = a + b w; motor alone, whole drive, the difference
// is the load.
//
// Whether the line is straight: a quadratic term and a root are added in turn; a warning where Student's t of
// either has a chance below 1 % on a straight line (t beyond 3.5 with ten runs). Table B.3: forward the root
// with t = 3.9, backward nothing (quadratic t = 2.3, a chance of 5 %).
// A row is named where its t against the line through the others has a chance below 1 % among all rows.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/procedures/constant_speed.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

enum class Direction { positive, negative };

/// T_f = coulomb + viscous w over the rows of one direction; for w < 0 coulomb < 0, viscous > 0.
struct FrictionLine {
  signal::Measured coulomb, viscous;            // N m, N m s/rad
  double covariance = 0;                        // of the two
  std::vector<double> speed, torque, residual;  // one per row, N m measured minus line
  double rms = 0;                               // N m, of the residuals, root of the mean square
  double quadratic = 0, quadratic_t = 0;  // c and its t value in a + b w + c w^2; 0 with fewer than 4 speeds
  double root_a = 0, root_b = 0, root_rms = 0;  // a + b sign(w) sqrt(|w|) instead of the line
  double root_t = 0;                            // t value of the root added to the line
  std::vector<std::string> warnings;            // what a straight line leaves, rows far off the others
};

/// Least squares. Where all rows have standard errors s_i of the torque, weights 1 / (s_i^2 + u^2), u^2 the
/// excess variance that makes chi^2 equal to its degrees of freedom (Mandel and Paule 1970), so that rows
/// with tiny errors do not rule where the line itself is not exact. Throws CannotIdentify with fewer than two
/// distinct speeds in the direction, and with only two rows without standard errors.
FrictionLine fit_friction_line(const std::vector<ConstantSpeedRun>& runs, Direction direction);

}  // namespace backlash::identification
