// SPDX-License-Identifier: BSD-3-Clause
// Dry friction that builds up over a short path after each reversal, by the law of Dahl (1968, Aerospace
// Corp. TOR-0158(3107-18)-1, exponent 1), in closed form:
//
//   dF/dx = (F_c - F) / x_s        F = F_c - (F_c - F_0) exp(-x / x_s)
//
// x [rad] path since the reversal, F against the present motion, F_0 its value at the reversal, F_c what it
// tends to, x_s the presliding distance. Continuous, independent of rate; a body at rest is held by it as by
// a spring of at most 2 F_c / x_s, from rest without load F_c / x_s. If F_c changes on the way (by other
// terms), its present value is used for the whole way since the reversal.
//
// With a damping s [N m s/rad] of the bristles the body feels F + s w (1 - F / F_c), w [rad/s] its speed: the
// friction of LuGre (Canudas de Wit, Olsson, Astrom and Lischinsky 1995, IEEE Trans. Autom. Control 40:419,
// Eqs. 3 to 5, with their sigma_0 = F_c / x_s, sigma_1 = s). This friction never drives, as |F| <= F_c.
#pragma once

#include <vector>

#include "backlash_diagnosis/model/term.h"

namespace backlash::model {

/// State of presliding friction: position of the last reversal, and the friction there.
class Presliding {
 public:
  explicit Presliding(double position = 0, double friction = 0) : position_(position), friction_(friction) {}

  /// Friction [N m], > 0 against forward motion, at `position` [rad] while moving in this direction (+1, -1;
  /// 0: the value at the reversal). Needs limits.presliding > 0.
  double friction(int direction, const FrictionLimits& limits, double position) const;

  /// The same with the damping of the bristles at `rate` [rad/s], whose sign is `direction`.
  double friction(int direction, const FrictionLimits& limits, double position, double rate) const;

 private:
  double position_, friction_;
};

/// The same along a recorded motion: friction [N m] of each sample, > 0 against forward motion, from a start
/// without load. Limits without presliding give Coulomb friction.
///
/// The sign of a rate [rad/s] is the direction (0: as before), its size gives the damping. With `interval`
/// [s] > 0 the place of a reversal between two samples follows from the rates; with 0 it is the earlier
/// sample. Noise on the columns looks like reversals and makes friction too small: both must be smooth to a
/// small fraction of x_s. Throws InvalidParameter for columns of different length.
std::vector<double> presliding_friction(const std::vector<double>& positions,
                                        const std::vector<FrictionLimits>& limits,
                                        const std::vector<double>& rates, double interval = 0);

}  // namespace backlash::model
