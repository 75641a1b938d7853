// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/restitution.h"

namespace backlash::model {
namespace {

// REFERENCE 1.3: wanted e, exact D, and the e that each approximation of D gives; printed to three or four
// digits.
TEST(Restitution, MatchesThePublishedTable) {
  struct Row {
    double e, exact, hunt_crossley, yang_sun, lankarani_nikravesh, lee_wang, gonthier, flores;
  };
  const Row table[] = {{0.9, 0.1665, 0.909, 0.901, 0.913, 0.952, 0.876, 0.894},
                       {0.8, 0.3731, 0.833, 0.807, 0.847, 0.909, 0.768, 0.789},
                       {0.5, 1.4328, 0.663, 0.594, 0.725, 0.799, 0.488, 0.470},
                       {0.2, 4.9192, 0.547, 0.501, 0.672, 0.712, 0.205, 0.156}};
  for (const Row& row : table) {
    EXPECT_NEAR(damping_of_restitution(row.e), row.exact, 5e-5);  // half of the last digit
    EXPECT_NEAR(restitution_of_damping(hunt_crossley_damping(row.e)), row.hunt_crossley, 5e-4);
    EXPECT_NEAR(restitution_of_damping(yang_sun_damping(row.e)), row.yang_sun, 5e-4);
    EXPECT_NEAR(restitution_of_damping(lankarani_nikravesh_damping(row.e)), row.lankarani_nikravesh, 5e-4);
    EXPECT_NEAR(restitution_of_damping(lee_wang_damping(row.e)), row.lee_wang, 5e-4);
    EXPECT_NEAR(restitution_of_damping(gonthier_damping(row.e)), row.gonthier, 5e-4);
    EXPECT_NEAR(restitution_of_damping(flores_damping(row.e)), row.flores, 5e-4);
  }
}

TEST(Restitution, BothWaysSolveTheEquation) {
  for (double e = 0.05; e < 0.999; e += 0.0007) {
    const double d = damping_of_restitution(e);
    EXPECT_NEAR(d * (1 + e), std::log((1 + d) / (1 - e * d)),
                1e-7);  // 1 - eD cancels: 1e-16 / 2e-8 at e = 0.05
    EXPECT_NEAR(restitution_of_damping(d), e, 1e-14);
  }
}

TEST(Restitution, HasItsLimits) {
  EXPECT_EQ(damping_of_restitution(1), 0);
  EXPECT_EQ(restitution_of_damping(0), 1);
  for (double loss = 1e-3; loss > 1e-14; loss /= 7) {  // D -> 3/2 (1 - e), next term 9/8 or so of its square
    const double e = 1 - loss;
    EXPECT_NEAR(damping_of_restitution(e), 1.5 * (1 - e), 2 * loss * loss + 1e-15) << loss;
    EXPECT_NEAR(restitution_of_damping(1.5 * loss), 1 - loss, 2 * loss * loss + 1e-15) << loss;
  }
  for (double e :
       {0.04, 0.03, 0.0299, 0.01, 1e-5, 1e-300}) {  // 1 - eD = (1 + D) exp(-(1 + D)(1 + ...)) vanishes
    EXPECT_NEAR(e * damping_of_restitution(e), 1, 1e-9) << e;
    EXPECT_LE(e * damping_of_restitution(e), 1) << e;
  }
  for (double d : {30.0, 1e3, 1e8, 1e300}) EXPECT_NEAR(d * restitution_of_damping(d), 1, 1e-10) << d;
  double last = 0;
  for (double e = 1; e > 1e-3; e -= 1e-3) {  // no step where the methods meet
    const double d = damping_of_restitution(e);
    EXPECT_GE(d, last) << e;
    last = d;
  }
}

TEST(Restitution, RefusesWhatNoImpactHas) {
  for (double e : {0.0, -0.5, 1.0000001, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(damping_of_restitution(e), InvalidParameter) << e;
  for (double d : {-1e-9, std::nan("")}) EXPECT_THROW(restitution_of_damping(d), InvalidParameter) << d;
}

/// Approach of m = K = v = 1 by the classical Runge-Kutta method of fourth order; then the elastic return.
double integrated_jankowski(double xi) {
  const double h = 1e-4;
  double d = 0, v = 1, before_d = 0, before_v = 1;
  const auto acceleration = [xi](double x, double speed) {
    x = std::max(x, 0.0);
    return -x * std::sqrt(x) - 2 * xi * std::sqrt(std::sqrt(x)) * speed;
  };
  while (v > 0) {
    before_d = d, before_v = v;
    const double a1 = acceleration(d, v), v2 = v + h / 2 * a1, a2 = acceleration(d + h / 2 * v, v2),
                 v3 = v + h / 2 * a2, a3 = acceleration(d + h / 2 * v2, v3), v4 = v + h * a3,
                 a4 = acceleration(d + h * v3, v4);
    d += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  const double deepest =
      before_d + 0.5 * before_v * h * before_v / (before_v - v);  // v falls evenly in the last step
  return std::sqrt(0.8 * std::pow(deepest, 2.5));
}

TEST(Restitution, JankowskiClosedFormIsTheIntegratedImpact) {
  // 0.8, 1.118034 = sqrt(5) / 2 and 3: less than, exactly and more than critical
  for (double xi : {0.0, 0.05, 0.3, 0.8, std::sqrt(5) / 2, 1.1180341, 3.0})
    EXPECT_NEAR(jankowski_restitution(xi), integrated_jankowski(xi), 1e-6)
        << xi;  // d^(1/4) at the start: h^(5/4)
}

TEST(Restitution, JankowskiFitsAreAsCloseAsTheyAre) {
  for (double e = 0.05; e <= 1; e += 0.01) {
    const double fit = jankowski_restitution(jankowski_damping_ratio(e));
    const double first = jankowski_restitution(jankowski_first_damping_ratio(e));
    EXPECT_NEAR(fit, e, 0.009) << e;                           // measured: at most 0.0089 below, at e = 0.14
    EXPECT_NEAR(first, e, 0.08) << e;                          // measured: at most 0.077 above, at e = 0.28
    EXPECT_LT(std::fabs(fit - e), std::fabs(first - e)) << e;  // "reported closest to numerical solutions"
  }
}

TEST(Restitution, RigidBodiesKeepMomentumAndPartAtTheRestitution) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (double e : {0.0, 0.3, 1.0})
    for (double m1 : {0.1, 2.0})
      for (double m2 : {0.1, 50.0}) {
        const ImpactSpeeds before{0.7, -0.2}, after = speeds_after_impact(m1, m2, before, e);
        EXPECT_NEAR(m1 * after.first + m2 * after.second, m1 * 0.7 - m2 * 0.2, 1e-14 * m2);
        EXPECT_NEAR(after.second - after.first, e * 0.9, 1e-15);
      }
  const ImpactSpeeds wall = speeds_after_impact(3, infinity, {0.5, 0}, 0.4);
  EXPECT_DOUBLE_EQ(wall.first, -0.2);
  EXPECT_EQ(wall.second, 0);
}

}  // namespace
}  // namespace backlash::model
