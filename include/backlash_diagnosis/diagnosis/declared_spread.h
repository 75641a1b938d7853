// SPDX-License-Identifier: BSD-3-Clause
// How far the answers of a monitoring curve may be off on machines that the rig file allows.
//
// A curve is that of one machine, the declared one. What the file does not know exactly (WaveformSpread) is
// drawn many times, each such machine is recorded with known backlash and diagnosed with the curve. Beyond
// the interval of an answer b lies the truth by at most
//   below(b) = max (lower - truth),  above(b) = max (truth - upper)     over answers near b, not below 0
// by which the interval is widened, also beyond the curve's end: the drawn machines have up to 1.5 times its
// backlash. By order statistics the next of k machines is farther off with a probability of 1 / (k + 1): with
// fewer than kFewest answers at all the interval becomes all that was drawn.
//
// Counted are those drawn machines that look like one of the curve, as all others are refused
// (out_of_domain). Where most of them do not, one that does may do so by chance, with another backlash: that
// makes the interval wide.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/not_a_number.h"

namespace backlash::diagnosis {

class MonitoringCurve;
struct Estimate;

struct DeclaredSpread {
  /// Of an estimator.
  struct Widening {
    std::vector<double> below, above;  ///< m, >= 0, one per point of the curve
    double bound = kNaN;               ///< m, >= 0: by which a lower bound was above the truth
  };
  int machines = 0;   ///< drawn, > 0
  std::string limit;  ///< what changes skewness most, in words
  Widening skewness, shape;

  static constexpr int kFewest = 39;  ///< answers. Theory: 1 / 40 on either side, the rest of 95 %
};

/// Widens the interval of an answer or a lower bound that an estimator took from the curve, and says what
/// limits it where it becomes more than twice as wide; or makes it "cannot tell" where the drawn machines
/// cannot say by how much. Nothing without a spread.
void widen(const MonitoringCurve& curve, DeclaredSpread::Widening DeclaredSpread::*method,
           Estimate& estimate);

}  // namespace backlash::diagnosis
