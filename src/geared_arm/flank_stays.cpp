// SPDX-License-Identifier: BSD-3-Clause
#include "flank_stays.h"

#include <cmath>

namespace backlash::geared_arm {

std::size_t guard_rows(const PlaySettings& settings) {
  return std::size_t(std::ceil(settings.settle * kRowsPerCycle));
}

double certain_load(const JointLoad& load, double most, const PlaySettings& settings) {
  return load.link_coulomb + settings.least_load * most;
}

std::vector<int> sides_of(const std::vector<double>& torque, const std::vector<bool>& first, double least,
                          std::size_t guard) {
  std::vector<int> sides(torque.size(), 0);
  std::size_t since = 0;  // rows on the same side without a break
  int last = 0;
  for (std::size_t k = 0; k < torque.size(); ++k) {
    const int side = torque[k] > least ? 1 : torque[k] < -least ? -1 : 0;
    since = side != 0 && side == last && !first[k] ? since + 1 : 0;
    last = side;
    if (since >= 2 * guard) sides[k - guard] = side;
  }
  return sides;
}

std::vector<std::size_t> stays_of(const std::vector<int>& sides, std::size_t count[2]) {
  std::vector<std::size_t> stay(sides.size(), 0);
  count[0] = count[1] = 0;
  for (std::size_t k = 0; k < sides.size(); ++k) {
    if (sides[k] == 0) continue;
    if (k == 0 || sides[k - 1] != sides[k]) ++count[sides[k] > 0];
    stay[k] = count[0] + count[1] - 1;
  }
  return stay;
}

}  // namespace backlash::geared_arm
