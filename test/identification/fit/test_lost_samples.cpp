// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/identification/fit/output_error.h"

namespace backlash::identification {
namespace {

constexpr double kInterval = 2e-3, kCutoff = 7, kNoise = 0.1;  // s, Hz, N m

model::Rig joint() {
  model::Rig rig;
  rig.mesh.rigid = true;
  rig.motor.inertia = 1.5;
  rig.motor.coulomb_friction = 3;
  return rig;
}

/// A sine of 1 Hz and the torque that it takes, plus `jump` [N m] in every tenth of a second by turns.
record::EvenGrid sine(double jump, bool one_of_twenty_lost) {
  record::EvenGrid grid;
  record::Record& r = grid.record;
  r.name = "sine";
  Random random(4);
  for (int k = 0; k < 8000; ++k) {
    const double t = k * kInterval, rate = 2 * M_PI * 0.3 * std::cos(2 * M_PI * t);
    r.time.push_back(t);
    r.column(record::Channel::motor_position).push_back(0.3 * std::sin(2 * M_PI * t));
    r.column(record::Channel::motor_torque)
        .push_back(-1.5 * std::pow(2 * M_PI, 2) * 0.3 * std::sin(2 * M_PI * t) + std::copysign(3, rate) +
                   (k / 50 % 2) * jump + kNoise * random.normal());
    grid.lost.push_back(one_of_twenty_lost && k % 20 == 10);
  }
  return grid;
}

/// Of all samples.
double counted(double jump, bool one_of_twenty_lost) {
  FitSettings settings;
  settings.cutoff = kCutoff;
  const std::vector<char> counts =
      predict_servo(joint(), servo_data(sine(jump, one_of_twenty_lost), joint()), settings, {}).counts;
  return double(std::count(counts.begin(), counts.end(), 1)) / double(counts.size());
}

TEST(LostSamples, CostNoMoreThanThemselves) {
  const double whole = counted(0, false);
  EXPECT_GT(whole, 0.8);
  EXPECT_NEAR(counted(0, true), 0.95 * whole, 0.03);  // and beside a reversal a few
}

// Every fifth of the losses is at a jump of the torque: there the line between its ends is no torque.
TEST(LostSamples, WhereTheTorqueJumpsTheirSurroundingsToo) {
  EXPECT_LT(counted(20, true), 0.5 * counted(20, false));
}

}  // namespace
}  // namespace backlash::identification
