// SPDX-License-Identifier: BSD-3-Clause
// The teeth of one rig (Real = double) or of several (lanes, whose header stands before this one):
// PowerContact, with what the gap adds.
#pragma once

#include "backlash_diagnosis/model/contact_law.h"
#include "one_lane.h"

namespace backlash::simulation {

template <typename Real>
struct PowerTeeth {
  double exponent;
  Real stiffness, loss, damping, half_gap;

  BACKLASH_LANES Real power(const Real& d) const {
    if (exponent == 1.5) return d * root(d);
    if (exponent == 1) return d;
    return any_power(d, exponent);
  }

  /// At a position in the gap [m] that changes at this rate [m/s].
  BACKLASH_LANES Real force(const Real& x, const Real& v) const {
    const Real depth = magnitude(x) - half_gap, none = {};
    const Real touching = larger(depth, none), rate = x > 0 ? v : -v;
    const Real push =
        larger(stiffness * power(touching) * larger(1 + loss * rate, none) + damping * rate, none);
    return depth > 0 ? (x > 0 ? push : -push) : none;
  }
};

}  // namespace backlash::simulation
