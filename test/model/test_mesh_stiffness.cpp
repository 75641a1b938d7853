// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/mesh_stiffness.h"
#include "support/gears.h"

namespace backlash::model {
namespace {

using test::gear_pair;
using test::sarkar_gears;

// Stainless 303 and the face width of Sarkar, Ellis and Moore (1997), Table 2; modulus and Poisson ratio are
// not printed there.
MeshStiffnessSettings settings(const std::string& law, double transition = 0) {
  return {law, 6.35e-3, 193e9, 0.29, transition};
}

/// Mean over one cycle by the midpoint rule, apart from the code's own integral.
double average(const std::function<double(double)>& f, int points = 100000) {
  double sum = 0;
  for (int i = 0; i < points; ++i) sum += f((i + 0.5) / points);
  return sum / points;
}

TEST(MeshStiffness, HertzContactOfSarkarsGears) {
  EXPECT_NEAR(hertz_stiffness(193e9, 0.29) * 6.35e-3, 1.0509277e9,
              1e3);                                             // pi 193e9 0.00635 / (4 (1 - 0.0841))
  EXPECT_NEAR(hertz_stiffness(206e9, 0.3) / 1e9, 177.8, 0.05);  // N/(um mm)
}

TEST(MeshStiffness, BendingPolynomialOnThePitchCircle) {
  // 3.867 + 64.48 - 46.656 + 9.9392 = 31.6302 N/(um mm) for 40 teeth
  EXPECT_NEAR(bending_stiffness({40, 1, 0, 0}, 0.79375e-3, 20 * 0.79375e-3) / 1e9, 31.6302, 1e-9);
  // 20 teeth, shift 0.5, one module above the pitch circle: A0 = 25.6854, A1 = 25.5252, A2 = -13.8782,
  // A3 = -19.622: A0 + A1/2 + (A2 + A3/2) / 1.5
  EXPECT_NEAR(bending_stiffness({20, 1, 0.5, 0}, 2e-3, 22e-3) / 1e9, 22.6552, 5e-5);
  EXPECT_THROW(bending_stiffness({280, 1, 0, 0}, 1e-3, 0.14), InvalidParameter);
  EXPECT_THROW(bending_stiffness({11, 1, 0, 0}, 1e-3, 5.5e-3), InvalidParameter);
  EXPECT_THROW(bending_stiffness({40, 1, 0.7, 0}, 1e-3, 20e-3), InvalidParameter);
  EXPECT_THROW(bending_stiffness({40, 1, 0, 0}, 1e-3, 23e-3),
               InvalidParameter);  // -13.9 per module: below zero
}

TEST(MeshStiffness, StepIsOnePairOrTwo) {
  const MeshStiffness mesh(sarkar_gears(), settings("step"));
  const double k = hertz_stiffness(193e9, 0.29) * 6.35e-3;
  EXPECT_NEAR(mesh.stiffness(0.3), 2 * k, 1e-6 * k);
  EXPECT_NEAR(mesh.stiffness(0.9), k, 1e-6 * k);
  EXPECT_NEAR(mesh.mean(), 1.7135336 * k, 1e-7 * k);  // contact ratio pairs on average
}

TEST(MeshStiffness, TwoPairsTouchForTheFractionBeyondOne) {
  for (const double change : {0.0, 50e-6, 300e-6, 600e-6}) {
    const MeshStiffness mesh(sarkar_gears(change), settings("step"));
    const double eps = mesh.geometry().contact_ratio;
    EXPECT_EQ(mesh.pairs(0), 2);
    EXPECT_EQ(mesh.pairs(eps - 1 - 1e-9), 2);
    EXPECT_EQ(mesh.pairs(eps - 1 + 1e-9), 1);
    EXPECT_EQ(mesh.pairs(1 - 1e-9), 1);
    EXPECT_NEAR(average([&](double phase) { return mesh.pairs(phase) == 2; }), eps - 1, 2e-5);  // one point
    EXPECT_NEAR(average([&](double phase) { return mesh.pairs(phase); }), eps, 2e-5);
  }
  GearPair slender = gear_pair(60, 60, 1e-3);  // tall teeth: always two pairs, sometimes three
  slender.pinion.addendum = slender.gear.addendum = 1.4;
  const MeshStiffness mesh(slender, settings("step"));
  ASSERT_GT(mesh.geometry().contact_ratio, 2);
  EXPECT_NEAR(average([&](double phase) { return mesh.pairs(phase); }), mesh.geometry().contact_ratio, 2e-5);
  EXPECT_EQ(mesh.pairs(0), 3);
  EXPECT_EQ(mesh.pairs(0.99), 2);
}

TEST(MeshStiffness, LinParkerParabola) {
  const MeshStiffness mesh(sarkar_gears(), settings("lin_parker"));
  const double eps = mesh.geometry().contact_ratio;
  // Single stiffness of 40 and 40 teeth: 0.8 / (0.04723 + 0.41342 / 40) 193 / 206 = 13.0202 N/(um mm)
  const double most = 13.02020417e9 * 6.35e-3;
  EXPECT_NEAR(mesh.mean(), 0.85 * eps * most, 1e-6 * most);   // Eq. 2.31
  EXPECT_NEAR(mesh.stiffness(0.5 * eps), most, 1e-6 * most);  // alone in contact in the middle of its life
  EXPECT_NEAR(mesh.stiffness(0), (0.55 + 0.55 + 1.8 / eps * (1 - 1 / eps)) * most, 1e-6 * most);
  // ISO's pinion is the smaller gear, whichever drives.
  EXPECT_NEAR(MeshStiffness(gear_pair(20, 40, 1e-3), settings("lin_parker")).stiffness(0.8),
              MeshStiffness(gear_pair(40, 20, 1e-3), settings("lin_parker")).stiffness(1.63518596 - 0.8), 1);
}

TEST(MeshStiffness, HertzAndBending) {
  // Contact points walked along the line of action in Cartesian coordinates outside this code.
  const MeshStiffness equal(sarkar_gears(), settings("hertz_bending"));
  EXPECT_NEAR(equal.stiffness(0.5 * equal.geometry().contact_ratio) / 9.16663187e7, 1,
              1e-8);  // 14.4 N/(um mm)
  EXPECT_NEAR(equal.mean() / 1.40352956e8, 1, 1e-7);
  GearPair pair = gear_pair(20, 40, 2e-3);
  pair.centre_distance_change = 100e-6;
  const MeshStiffness unequal(pair, {"hertz_bending", 20e-3, 206e9, 0.3, 0});
  EXPECT_NEAR(unequal.mean() / 3.698312436e8, 1, 1e-7);
  const double half_life = 0.5 * unequal.geometry().contact_ratio;
  EXPECT_NEAR(unequal.stiffness(half_life) / 2.593788017e8, 1, 1e-8);
  // At phase 0 one pair touches for the first time and another is one base pitch on.
  const double edge = 1.805090919e8;
  EXPECT_GT(unequal.stiffness(1e-9), unequal.stiffness(1 - 1e-9) + 0.99 * edge);
  EXPECT_LT(unequal.stiffness(1e-9), unequal.stiffness(1 - 1e-9) + 1.01 * edge);
}

TEST(MeshStiffness, PeriodicWithTheStatedMean) {
  for (const std::string& law : mesh_stiffness_laws())
    for (const double transition : {0.0, 0.1, 0.5})
      for (const double change : {0.0, 550e-6}) {
        const MeshStiffness mesh(sarkar_gears(change), settings(law, transition));
        // One point of the midpoint rule at each of the two jumps.
        EXPECT_NEAR(average([&](double p) { return mesh.stiffness(p); }) / mesh.mean(), 1, 3e-5) << law;
        for (const double phase : {0.123, 0.5, 0.987}) {
          EXPECT_NEAR(mesh.stiffness(phase + 7), mesh.stiffness(phase), 1e-9 * mesh.mean());
          EXPECT_NEAR(mesh.stiffness(phase - 7), mesh.stiffness(phase), 1e-9 * mesh.mean());
          // Equal gears: driven the other way the cycle runs backwards.
          EXPECT_NEAR(mesh.stiffness(mesh.geometry().contact_ratio - phase), mesh.stiffness(phase),
                      1e-6 * mesh.mean());
        }
      }
}

TEST(MeshStiffness, TransitionIsContinuous) {
  const auto largest_jump = [](const MeshStiffness& mesh) {
    double largest = 0;
    for (double p = 0; p < 1; p += 1e-4)
      largest = std::max(largest, std::fabs(mesh.stiffness(p + 1e-4) - mesh.stiffness(p)));
    return largest / mesh.mean();
  };
  for (const std::string& law : mesh_stiffness_laws()) {
    EXPECT_GT(largest_jump(MeshStiffness(sarkar_gears(), settings(law))), 0.3) << law;
    // Steepest slope of the cubic 1.5 / 0.1 per base pitch, times a jump below one mean.
    EXPECT_LT(largest_jump(MeshStiffness(sarkar_gears(), settings(law, 0.1))), 1.6e-3) << law;
  }
}

TEST(MeshStiffness, NonsenseIsRefused) {
  const auto refused = [](const GearPair& pair, MeshStiffnessSettings s) {
    EXPECT_THROW(MeshStiffness(pair, s), InvalidParameter) << s.law;
  };
  refused(sarkar_gears(), settings("sine"));
  refused(sarkar_gears(1e-3), settings("step"));  // contact ratio 0.6
  refused(gear_pair(12, 12, 1e-3), settings("step"));
  refused(sarkar_gears(), {"step", 0, 193e9, 0.29, 0});
  refused(sarkar_gears(), {"step", 1e-3, -193e9, 0.29, 0});
  refused(sarkar_gears(), {"step", 1e-3, 193e9, 0.6, 0});
  refused(sarkar_gears(), {"step", 1e-3, 193e9, 0.29, 0.6});
  refused(sarkar_gears(), {"hertz_bending", 1e-3, 70e9, 0.33, 0});  // aluminium
  refused(gear_pair(20, 280, 1e-3), settings("hertz_bending"));
  GearPair shifted = gear_pair(20, 40, 1e-3);
  shifted.gear.profile_shift = 0.2;
  refused(shifted, settings("lin_parker"));
}

}  // namespace
}  // namespace backlash::model
