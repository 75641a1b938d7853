// SPDX-License-Identifier: BSD-3-Clause
// Planned motions against finite differences and a closed form.
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/simulation/fourier_motion.h"

namespace backlash::simulation {
namespace {

/// At rest at the begin of a period: b_1 + 2 b_2 = 0, a_1 + 4 a_2 = 0.
FourierMotion example() {
  FourierMotion m;
  m.start = -0.3;
  m.approach = 2.5;
  m.period = 8;
  m.offset = 0.7;
  m.cosines = {0.4, -0.1};
  m.sines = {-0.6, 0.3};
  return m;
}

TEST(FourierMotion, FollowsTheSeries) {
  const FourierMotion m = example();
  for (double s = 0; s < 20; s += 0.37) {
    const double x = 2 * M_PI * s / 8;
    EXPECT_NEAR(kinematics(m, 2.5 + s).position,
                0.7 + 0.4 * std::cos(x) - 0.1 * std::cos(2 * x) - 0.6 * std::sin(x) + 0.3 * std::sin(2 * x),
                1e-14);
  }
}

TEST(FourierMotion, SpeedAndAccelerationAreDerivatives) {
  const FourierMotion m = example();
  const double h = 1e-5;  // errors of central differences: h^2 / 6 times the third derivative, some 1e-10
  for (double t = 0.1; t < 20; t += 0.0737) {
    if (std::fabs(t - m.approach) < 2 * h) continue;
    const Kinematics before = kinematics(m, t - h), now = kinematics(m, t), after = kinematics(m, t + h);
    EXPECT_NEAR(now.velocity, (after.position - before.position) / (2 * h), 1e-9) << t;
    EXPECT_NEAR(now.acceleration, (after.velocity - before.velocity) / (2 * h), 1e-9) << t;
  }
}

TEST(FourierMotion, BeginsAndEndsAtRest) {
  const FourierMotion m = example();
  for (const double t : {0.0, 2.5, 10.5, 18.5}) {
    EXPECT_NEAR(kinematics(m, t).velocity, 0, 1e-14) << t;
    EXPECT_NEAR(kinematics(m, t).acceleration, 0, 1e-14) << t;
  }
  EXPECT_DOUBLE_EQ(kinematics(m, 0).position, -0.3);
  EXPECT_NEAR(kinematics(m, 2.5 - 1e-9).position, kinematics(m, 2.5).position, 1e-14);
  EXPECT_NO_THROW(check(m));
}

TEST(FourierMotion, RefusesWhatIsNoMotion) {
  const auto refused = [](auto change) {
    FourierMotion m = example();
    change(m);
    EXPECT_THROW(check(m), InvalidParameter);
  };
  refused([](FourierMotion& m) { m.sines[0] = 0.6; });        // moves where a period begins
  refused([](FourierMotion& m) { m.cosines[1] = -0.1001; });  // accelerates there
  refused([](FourierMotion& m) { m.sines.pop_back(); });
  refused([](FourierMotion& m) { m.period = 0; });
  refused([](FourierMotion& m) { m.approach = -1; });
  refused([](FourierMotion& m) { m.offset = NAN; });
}

}  // namespace
}  // namespace backlash::simulation
