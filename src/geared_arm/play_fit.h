// SPDX-License-Identifier: BSD-3-Clause
// Two flanks fitted to the deflection of one joint of an arm, by every law that the record does not rule out:
//
//   phi = f + side b / 2 + g e(T) + s q + sum_k (r_k cos k q + u_k sin k q) + d v
//
// e(T): of teeth that yield as a power of the load (a spring 1, Hertz 2/3), or of springs that harden with
// the first or the second power of the deflection. r, u: an encoder or gear that is out of centre, oval or
// bent, up to three waves per turn, where the record shows them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace backlash::geared_arm {

/// One row per low-passed sample of a joint.
struct FlankRows {
  std::vector<double> torque, twist;    // T [N m], phi [rad]
  std::vector<double> position, speed;  // q, v of the link
  std::vector<int> side;                // 1, -1; 0 where the flank is not certain
  std::vector<std::size_t> stay;        // number of the stay on a flank
  double per_cycle = 1;                 // rows that say the same, as they are low-passed
};

struct FlankPlayFit {
  double play = 0, error = 0;             // rad, by the law that leaves least; its standard error
  double lower = 0, upper = 0;            // rad, 95 %, over the laws that are not ruled out
  double compliance = 0, softest = 0;     // rad/(N m), at the mean load, and at the least that counts
  double between = 0, between_error = 0;  // rad, 95 %: from the mean load on one flank to that on the other
  double residual = 0;                    // rad, rms
  std::string law;                        // for people
};

FlankPlayFit fit_flank_play(const FlankRows& rows);

}  // namespace backlash::geared_arm
