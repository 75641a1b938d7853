// SPDX-License-Identifier: BSD-3-Clause
// Values of strengths and shapes that the search for missing effects tries, of several terms.
#pragma once

#include <vector>

#include "backlash_diagnosis/model/term.h"

namespace backlash::model {

/// Large compared with a torque noise of 1 %, small compared with the torque that moves the machine.
inline double clear_torque(const MotionRange& range) {
  return 0.05 * range.torque;
}

inline double clear_angle(const MotionRange& range) {
  return 0.1 * range.deflection;
}

/// The orders 1 to LAST of an effect that is periodic in a position.
template <int LAST>
TermShape orders() {
  return {"order",
          [](const MotionRange&) {
            std::vector<double> all;
            for (int n = 1; n <= LAST; ++n) all.push_back(n);
            return all;
          },
          false};
}

}  // namespace backlash::model
