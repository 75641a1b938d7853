// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_geometry.h"
#include "support/gears.h"

namespace backlash::model {
namespace {

using test::gear_pair;
using test::sarkar_gears;

constexpr double kDegree = M_PI / 180;

TEST(GearGeometry, InvoluteAgreesWithPrintedTables) {
  // Six printed digits of the usual involute tables.
  EXPECT_NEAR(involute(14.5 * kDegree), 0.005545, 5e-7);
  EXPECT_NEAR(involute(20 * kDegree), 0.014904, 5e-7);
  EXPECT_NEAR(involute(25 * kDegree), 0.029975, 5e-7);
  EXPECT_NEAR(involute(30 * kDegree), 0.053751, 5e-7);
}

TEST(GearGeometry, InverseInvoluteInverts) {
  EXPECT_EQ(inverse_involute(0), 0);
  for (double degrees = 1; degrees < 89.9; degrees += 0.37) {
    const double angle = degrees * kDegree, slope = std::pow(std::tan(angle), 2);
    // Rounding of tan and of the subtraction, through the slope of the function.
    EXPECT_NEAR(inverse_involute(involute(angle)), angle, 4e-16 * (1 + std::tan(angle)) * (1 + 1 / slope))
        << degrees;
  }
  for (const double bad : {-1e-9, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(inverse_involute(bad), InvalidParameter);
}

struct Row {
  double change_um, angle_deg, contact_ratio, backlash_um, small_change_um;
};

TEST(GearGeometry, SarkarGearsAtFiveCentreDistances) {
  // Computed for the gears of their Table 2 outside this code (flanks traced point by point), rounded as
  // shown.
  const Row rows[] = {{0, 20.000, 1.714, 0.00, 0.00},
                      {25, 20.123, 1.682, 17.15, 17.10},
                      {50, 20.246, 1.652, 34.40, 34.20},
                      {75, 20.368, 1.621, 51.76, 51.30},
                      {100, 20.489, 1.590, 69.21, 68.40}};
  for (const Row& row : rows) {
    const GearGeometry g = gear_geometry(sarkar_gears(row.change_um * 1e-6));
    EXPECT_NEAR(g.operating_pressure_angle / kDegree, row.angle_deg, 0.0005) << row.change_um;
    EXPECT_NEAR(g.contact_ratio, row.contact_ratio, 0.0005) << row.change_um;
    EXPECT_NEAR(1e6 * g.backlash, row.backlash_um, 0.005) << row.change_um;
    EXPECT_NEAR(2 * row.change_um * std::sin(20 * kDegree), row.small_change_um, 0.005);
    EXPECT_NEAR(g.pitch_circle_backlash, g.backlash / std::cos(g.operating_pressure_angle), 1e-18);
    EXPECT_TRUE(g.faults.empty());
    EXPECT_TRUE(g.remarks.empty());
  }
  const GearGeometry g = gear_geometry(sarkar_gears());
  EXPECT_EQ(g.backlash, 0);
  EXPECT_NEAR(1e3 * g.pinion.base_radius, 14.918, 0.0005);
  EXPECT_NEAR(1e3 * g.base_pitch, 2.343, 0.0005);
  EXPECT_NEAR(g.centre_distance, 0.03175, 1e-16);
}

TEST(GearGeometry, SarkarGearsAtTheirLimits) {
  EXPECT_NEAR(gear_geometry(sarkar_gears(610e-6)).contact_ratio, 1,
              5e-5);  // d eps / d change = 1.2e-3 per um
  EXPECT_NEAR(1e6 * gear_geometry(sarkar_gears(610e-6)).backlash, 446, 0.5);
  EXPECT_TRUE(gear_geometry(sarkar_gears(609e-6)).faults.empty());
  const auto faults = gear_geometry(sarkar_gears(611e-6)).faults;
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].substr(0, 13), "contact ratio");
  EXPECT_NEAR(1e6 * centre_distance_change_for(sarkar_gears(), 50e-6), 72.5, 0.05);
  const double angles_deg[] = {0.0960, 0.1920, 0.2881, 0.3841};  // of one shaft at 25, 50, 75, 100 um
  for (int i = 0; i < 4; ++i) {
    const double change = centre_distance_change_for(sarkar_gears(), (i + 1) * 25e-6);
    EXPECT_NEAR(gear_geometry(sarkar_gears(change)).pinion_backlash_angle() / kDegree, angles_deg[i], 5e-5);
  }
}

TEST(GearGeometry, TwentyAndFortyTeethOfModuleTwo) {
  // Buckingham's form of the contact ratio from the tip pressure angles 31.3215 and 26.4987 deg:
  // (20 (0.608540 - 0.363970) + 40 (0.498563 - 0.363970)) / 2 pi = 1.6353; base pitch 2 pi cos 20 = 5.90426
  // mm.
  GearPair pair = gear_pair(20, 40, 2e-3);
  GearGeometry g = gear_geometry(pair);
  EXPECT_NEAR(g.centre_distance, 0.060, 1e-16);
  EXPECT_NEAR(1e3 * g.base_pitch, 5.904263, 5e-7);
  EXPECT_NEAR(1e3 * g.pinion.base_radius, 18.793852, 5e-7);
  EXPECT_NEAR(1e3 * g.gear.tip_radius, 42, 1e-12);
  EXPECT_NEAR(g.contact_ratio, 1.63518596, 5e-9);
  EXPECT_NEAR(1e3 * g.length_of_contact, 9.65456777, 5e-9);
  // 100 um further apart, teeth 30 and 20 um thinner: from the tooth thicknesses on the operating circles,
  // with the flanks traced numerically as curves.
  pair.centre_distance_change = 100e-6;
  pair.pinion.thinning = 30e-6;
  pair.gear.thinning = 20e-6;
  g = gear_geometry(pair);
  EXPECT_NEAR(g.operating_pressure_angle / kDegree, 20.2603045, 5e-8);
  EXPECT_NEAR(g.contact_ratio, 1.58597288, 5e-9);
  EXPECT_NEAR(1e6 * g.backlash, 115.81646, 5e-6);
  EXPECT_NEAR(1e6 * g.pitch_circle_backlash, 123.454718, 5e-6);
  EXPECT_NEAR(1e6 * centre_distance_change_for(pair, 100e-6), 77.1307305, 5e-6);
  // The angle on the pinion is twice that on the gear of twice the teeth.
  EXPECT_NEAR(g.pinion_backlash_angle(), 115.81646e-6 / 18.793852e-3, 1e-9);
  EXPECT_NEAR(g.gear_backlash_angle(), 0.5 * g.pinion_backlash_angle(), 1e-15);
}

TEST(GearGeometry, OperatingThicknessesAndPlayFillTheOperatingPitch) {
  GearPair pair = gear_pair(17, 53, 1.5e-3, 25);
  pair.pinion.profile_shift = 0.4;
  pair.gear.profile_shift = -0.1;
  pair.gear.thinning = 40e-6;
  pair.centre_distance_change = 60e-6;
  const GearGeometry g = gear_geometry(pair);
  const double pitch = 2 * M_PI * g.pinion.operating_radius / 17;
  EXPECT_NEAR(g.pinion.operating_tooth_thickness + g.gear.operating_tooth_thickness + g.pitch_circle_backlash,
              pitch,
              1e-16);  // rounding of lengths of 5 mm
  EXPECT_NEAR(g.pinion.operating_radius + g.gear.operating_radius, g.centre_distance, 1e-16);
}

TEST(GearGeometry, ShiftedPairOfATextbook) {
  // Module 3, 20 deg, 12 and 24 teeth, shifts 0.6 and 0.36: KHK, Gear Technical Reference, profile-shifted
  // spur gear: working pressure angle 26.0886 deg, centre distance 56.4999 mm.
  GearPair pair = gear_pair(12, 24, 3e-3);
  pair.pinion.profile_shift = 0.6;
  pair.gear.profile_shift = 0.36;
  const GearGeometry g = gear_geometry(pair);
  EXPECT_NEAR(g.operating_pressure_angle / kDegree, 26.0886, 5e-5);
  EXPECT_NEAR(1e3 * g.centre_distance, 56.4999, 5e-5);
  EXPECT_EQ(g.backlash, 0);
}

TEST(GearGeometry, ShimAndBacklashAreInverse) {
  GearPair pair = gear_pair(23, 61, 1e-3);
  pair.gear.thinning = 20e-6;
  pair.pinion.profile_shift = 0.2;
  for (const double backlash : {0.0, 1e-6, 10e-6, 50e-6, 300e-6}) {
    pair.centre_distance_change = centre_distance_change_for(pair, backlash);
    EXPECT_NEAR(gear_geometry(pair).backlash, backlash, 1e-16)
        << backlash;  // rounding of 80 mm of base radii
  }
  // Thinning alone gives 20 um cos 20 deg = 18.8 um: less needs the axes closer together.
  EXPECT_LT(centre_distance_change_for(pair, 10e-6), 0);
  EXPECT_GT(centre_distance_change_for(pair, 20e-6), 0);
}

TEST(GearGeometry, SmallChangeFormsAreItsLimit) {
  const double change = 1e-7, phi = 20 * kDegree;
  const GearGeometry g = gear_geometry(sarkar_gears(change));
  // Next order: change / (2 Rb tan phi) = 1e-5 of the value.
  EXPECT_NEAR(g.backlash, 2 * change * std::sin(phi), 2e-5 * g.backlash);
  EXPECT_NEAR(g.pitch_circle_backlash, 2 * change * std::tan(phi), 3e-5 * g.backlash);
}

TEST(GearGeometry, FaultsAndRemarksAreReported) {
  // The least number of teeth that a rack of addendum 1 does not undercut is 2 / sin^2 20 deg = 17.097, and
  // with a rack the same limit is that of interference; a mate of few teeth reaches less deep.
  EXPECT_TRUE(gear_geometry(gear_pair(18, 18, 1e-3)).remarks.empty());
  EXPECT_EQ(gear_geometry(gear_pair(17, 18, 1e-3)).remarks.size(), 1u);
  EXPECT_TRUE(gear_geometry(gear_pair(18, 100000, 1e-3)).faults.empty());
  EXPECT_EQ(gear_geometry(gear_pair(16, 100000, 1e-3)).faults.size(), 1u);
  // Equal gears interfere below 12.3 teeth: N^2 sin^2 (1 + 2) >= 4 + 4 N, N = 12.32.
  EXPECT_TRUE(gear_geometry(gear_pair(13, 13, 1e-3)).faults.empty());
  EXPECT_EQ(gear_geometry(gear_pair(12, 12, 1e-3)).faults.size(), 2u);
  GearPair pointed = gear_pair(12, 60, 1e-3);
  pointed.pinion.profile_shift = 1.2;
  const auto faults = gear_geometry(pointed).faults;
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0], "the teeth of the pinion are pointed below their tip circle");
}

TEST(GearGeometry, NonsenseIsRefused) {
  const double nan = std::nan("");
  const std::function<void(GearPair&)> nonsense[] = {
      [](GearPair& p) { p.pinion.teeth = 0; },
      [](GearPair& p) { p.gear.teeth = 2; },
      [](GearPair& p) { p.module = 0; },
      [&](GearPair& p) { p.module = nan; },
      [](GearPair& p) { p.pressure_angle = 0; },
      [](GearPair& p) { p.pressure_angle = 20; },  // degrees
      [](GearPair& p) { p.pinion.addendum = 0; },
      [](GearPair& p) { p.gear.addendum = 5; },
      [](GearPair& p) { p.gear.profile_shift = 3; },
      [&](GearPair& p) { p.pinion.thinning = nan; },
      [](GearPair& p) { p.pinion.thinning = -1e-6; },         // jams
      [](GearPair& p) { p.centre_distance_change = -1e-6; },  // jams
      [](GearPair& p) { p.centre_distance_change = -5e-3; },  // base circles meet
      [&](GearPair& p) { p.centre_distance_change = INFINITY; },
      [](GearPair& p) { p.pinion.profile_shift = p.gear.profile_shift = -0.9; },  // no angle without play
  };
  int number = 0;
  for (const auto& change : nonsense) {
    GearPair pair = gear_pair(20, 40, 2e-3);
    change(pair);
    EXPECT_THROW(gear_geometry(pair), InvalidParameter) << number;
    ++number;
  }
  EXPECT_THROW(centre_distance_change_for(sarkar_gears(), -1e-6), InvalidParameter);
  GearPair thin = sarkar_gears();
  thin.pinion.thinning = 1.2e-3;  // its play of 1.13 mm passes 2 (Rb1 + Rb2) inv 20 deg = 0.89 mm
  EXPECT_THROW(centre_distance_change_for(thin, 0), InvalidParameter);
}

}  // namespace
}  // namespace backlash::model
