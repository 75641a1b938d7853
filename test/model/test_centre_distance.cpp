// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/centre_distance.h"
#include "support/gears.h"

namespace backlash::model {
namespace {

constexpr double kDegree = M_PI / 180;

TEST(CentreDistance, EquationsByHand) {
  // d = 0.5 mm, r1 = 200 mm, r2 = 100 mm, psi = 60 deg: dC = 0.5 x 0.5 x 0.5 = 0.125 mm;
  // B = 0.25 tan 20 deg = 0.0909926 mm, along the line of action 0.25 sin 20 deg = 0.0855050 mm.
  const HingedBracket bracket{0.2, 0.1, 60 * kDegree};
  const double change = centre_distance_change(bracket, 0.5e-3);
  EXPECT_NEAR(change, 0.125e-3, 1e-18);  // rounding
  EXPECT_NEAR(small_change_pitch_circle_backlash(change, 20 * kDegree), 0.0909926e-3, 5e-11);
  EXPECT_NEAR(small_change_backlash(change, 20 * kDegree), 0.0855050e-3, 5e-11);
  EXPECT_NEAR(stop_setting_for(bracket, change), 0.5e-3, 1e-17);
}

TEST(CentreDistance, BracketIsTheLimitOfARotation) {
  // The pinion on an arc about the pivot, the wheel 300 mm away along the normal of the mesh tangent (x
  // axis).
  const double psi = 25 * kDegree, r1 = 0.15, r2 = 0.12, centre = 0.3;
  const auto exact = [&](double turn) {
    const double x = r2 * (std::cos(psi + turn) - std::cos(psi));
    const double y = r2 * (std::sin(psi + turn) - std::sin(psi));
    return std::hypot(x, centre + y) - centre;
  };
  for (const double stop : {1e-3, 1e-4, 1e-5}) {
    const double turn = stop / r1, first = centre_distance_change({r1, r2, psi}, stop);
    // Second order: turn^2 r2 / 2 (r2 / centre + 1) bounds both the arc and the sideways motion.
    EXPECT_NEAR(exact(turn), first, 0.5 * turn * turn * r2 * (1 + r2 / centre)) << stop;
    EXPECT_GT(std::fabs(exact(turn) - first), 0);
  }
}

TEST(CentreDistance, SmallChangeFormsAreTheLimitOfTheExactOnes) {
  GearPair pair = test::gear_pair(15, 285, 3e-3);
  for (const double change : {1e-4, 1e-5, 1e-6}) {
    pair.centre_distance_change = change;
    const GearGeometry g = gear_geometry(pair);
    // Stated next order dC / (2 C tan^2 phi), to 1 % and the rounding of 1e-13 (Rb1 + Rb2).
    const double tangent = std::tan(pair.pressure_angle);
    const double order = change / (2 * g.tight_centre_distance * tangent * tangent);
    const double excess = g.backlash / small_change_backlash(change, pair.pressure_angle) - 1;
    EXPECT_NEAR(excess, order, 0.01 * order + 1e-13 * g.centre_distance / change) << change;
    const double pitch =
        g.pitch_circle_backlash / small_change_pitch_circle_backlash(change, pair.pressure_angle);
    EXPECT_NEAR(pitch, 1,
                4 * order);  // the operating angle grows as well: 1 + 3 tan^2 .. < 4 times the order
  }
}

TEST(CentreDistance, SensorStepOnTheThesisRig) {
  // 15 teeth; 0.0055 deg on the motor's shaft, 110 in all of which 285 / 15 in the mesh: 9.5e-4 deg at the
  // pinion. With module 3 mm (a ring of 0.43 m radius) that is 22.5 mm 1.658e-5 = 0.373 um: the printed 0.4
  // um.
  const double step = 0.0055 * kDegree / (110 / 19.0);
  EXPECT_NEAR(resolution_on_pitch_circle(15, 3e-3, step), 0.373e-6, 0.0005e-6);
}

TEST(CentreDistance, NonsenseIsRefused) {
  for (const HingedBracket& bad :
       {HingedBracket{0, 0.1, 0}, HingedBracket{0.1, -0.1, 0}, HingedBracket{0.1, 0.1, 90 * kDegree},
        HingedBracket{0.1, 0.1, std::nan("")}}) {
    EXPECT_THROW(centre_distance_change(bad, 1e-3), InvalidParameter);
    EXPECT_THROW(stop_setting_for(bad, 1e-3), InvalidParameter);
  }
  EXPECT_THROW(resolution_on_pitch_circle(0, 1e-3, 1e-5), InvalidParameter);
  EXPECT_THROW(resolution_on_pitch_circle(15, 0, 1e-5), InvalidParameter);
  EXPECT_THROW(resolution_on_pitch_circle(15, 1e-3, 0), InvalidParameter);
}

}  // namespace
}  // namespace backlash::model
