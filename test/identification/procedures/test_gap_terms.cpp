// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/identification/procedures/gap_terms.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "support/data.h"

namespace backlash::identification {
namespace {

const std::string kVarying = test::package_file("config/yumrukcal_2013_varying.yaml");
constexpr double kStiffness = 460e3;  // N m/rad, of that rig

/// Mean separation 6e-4, of it 0.5e-4 wind-up; orders 2 and 5.
GapMap hand_made_map() {
  GapMap map;
  map.mean_separation = {6e-4, 1e-6};
  map.wind_up = {0.5e-4, 1e-6};
  map.mean_gap = {5.5e-4, 1e-6};
  map.forward_speed = 0.2;
  map.reverse_speed = -0.1;
  map.harmonics = {{2, {4e-5, 1e-7}, {0.3, 1e-3}, 0}, {5, {1e-5, 1e-7}, {-1.2, 1e-3}, 0}};
  return map;
}

double gap_of(double mean, double q) {
  return mean + 4e-5 * std::sin(2 * q + 0.3) + 1e-5 * std::sin(5 * q - 1.2);
}

/// Distance between the flanks where the load is at q, from two penetrations and the stiffness alone.
double gap_in_train(const model::Rig& rig, double q) {
  const model::GearTrain train(rig);
  const double far = 1e-3;  // rad, deep in contact on either side
  double open = 0;
  for (const double side : {1.0, -1.0}) {
    const double state[] = {q + side * far, q, 0, 0};
    open += far - std::fabs(train.end_forces(0, state, 0).mesh_torque) / kStiffness;
  }
  return open;
}

TEST(GapTerms, TheGapOfTheModelIsThatOfTheMap) {
  const model::Rig varying = rig_file::load_rig_file(kVarying).rig;
  ASSERT_TRUE(gap_varies(varying));
  for (const auto& [use, mean] : {std::pair{GapUse::corrected, 5.5e-4}, std::pair{GapUse::directly, 6e-4},
                                  std::pair{GapUse::variation, 5.358e-4}}) {
    const model::Rig rig = with_gap_map(varying, hand_made_map(), use);
    EXPECT_EQ(rig.terms.size(), 2u);
    for (const double q : {0.0, 0.7, 2.0, 3.3, 5.9, 8.1})
      EXPECT_NEAR(gap_in_train(rig, q), gap_of(mean, q), 1e-12) << q;  // rounding of 1 rad / 1e-3 rad
  }
}

TEST(GapTerms, AMapThatDoesNotVaryGivesAConstantGap) {
  GapMap map = hand_made_map();
  map.harmonics.clear();
  const model::Rig rig = with_gap_map(rig_file::load_rig_file(kVarying).rig, map);
  EXPECT_FALSE(gap_varies(rig));
  EXPECT_NEAR(gap_in_train(rig, 1), 5.5e-4, 1e-12);
}

TEST(GapTerms, MeanOfAFitCountsTheErrorsOfTheOrders) {
  const GapMap map = with_mean_gap(hand_made_map(), {5.4e-4, 3e-7});
  EXPECT_EQ(map.mean_gap.value, 5.4e-4);
  EXPECT_NEAR(map.mean_gap.standard_error, std::sqrt(9e-14 + 2 * 1e-14), 1e-12);  // both amplitudes +- 1e-7
  EXPECT_NEAR(map.wind_up.value, 0.6e-4, 1e-12);
  EXPECT_NEAR(map.wind_up.standard_error, std::sqrt(1e-12 + 11e-14), 1e-12);
}

TEST(GapTerms, RigFileGetsTheEntriesAndKeepsTheRest) {
  rig_file::RigDocument document(rig_file::load_rig_file(kVarying));
  replace_gap_terms(document, hand_made_map(), 5.358e-4);
  const std::string changed = document.text();
  const rig_file::RigFile file = document.read();
  EXPECT_EQ(file.rig.terms.size(), 2u);
  // The text has five decimals of the relative amplitude, four of the phase: 5e-6 of 5.4e-4 and 5e-5 of 4e-5.
  for (const double q : {0.0, 0.7, 2.0, 3.3, 5.9})
    EXPECT_NEAR(gap_in_train(file.rig, q), gap_of(5.358e-4, q), 1e-8) << q;
  for (const char* part : {"# As a look-up table", "\nexcitation:", "15 % at most.\nterms:\n  - id: "})
    EXPECT_NE(changed.find(part), std::string::npos) << part;
  rig_file::RigDocument none("terms: []\n", "x.yaml");
  EXPECT_THROW(replace_gap_terms(none, hand_made_map(), 5e-4), BadData);
}

TEST(GapTerms, RefusesAGapThatIsNone) {
  GapMap map = hand_made_map();
  map.mean_gap.value = -1e-6;
  EXPECT_THROW(with_gap_map(rig_file::load_rig_file(kVarying).rig, map), InvalidParameter);
  rig_file::RigDocument document(rig_file::load_rig_file(kVarying));
  EXPECT_THROW(replace_gap_terms(document, map, 0), InvalidParameter);
  EXPECT_THROW(model::make_term("varying_backlash", {{"amplitude", 0.1}, {"order", -1}, {"phase", 0}}),
               InvalidParameter);
  EXPECT_THROW(model::make_term("no such", {}), InvalidParameter);
}

}  // namespace
}  // namespace backlash::identification
