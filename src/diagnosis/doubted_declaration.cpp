// SPDX-License-Identifier: BSD-3-Clause
#include "doubted_declaration.h"

#include <algorithm>
#include <cmath>

namespace backlash::diagnosis {
namespace {

// Simulation: of 161 answers of lost_motion about rigs with two of 65 effects that no rig file has 11 missed,
// two of them by more than this.
constexpr double kTimes = 2;

bool contradicts_the_file(const Estimate& e) {
  return e.waveform && (e.status == Status::out_of_domain || e.must_hold);
}

void widen(Estimate& e) {
  const double radius = e.upper / e.angle_upper, more = (kTimes * kTimes - 1) * e.declared * e.declared;
  const auto wider = [more](double half) { return std::sqrt(half * half + more); };
  e.angle_lower = std::max(0.0, e.backlash_angle - wider(e.backlash_angle - e.angle_lower));
  e.angle_upper = e.backlash_angle + wider(e.angle_upper - e.backlash_angle);
  e.lower = radius * e.angle_lower;
  e.upper = radius * e.angle_upper;
  e.declared *= kTimes;
  e.message +=
      "; the interval is wider, as waveform finds in the record no machine of the kind that the rig file "
      "describes";
}

}  // namespace

void doubt_declared_values(std::vector<Estimate>& estimates) {
  if (std::none_of(estimates.begin(), estimates.end(), contradicts_the_file)) return;
  for (Estimate& e : estimates)
    if (e.status == Status::ok && e.declared > 0 && e.angle_upper > 0) widen(e);
}

}  // namespace backlash::diagnosis
