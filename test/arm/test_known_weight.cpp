// SPDX-License-Identifier: BSD-3-Clause
// Oracle: machines whose torques KDL computes, whose constants are all off by the same factor, which nothing
// but a known weight shows.
#include <gtest/gtest.h>

#include <cmath>

#include "arm_machines.h"
#include "backlash_diagnosis/arm/fit_records.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"

namespace backlash::arm {
namespace {

struct Weighing {
  test::Machine machine;
  std::vector<RecordMotions> records;
  double other = 0;  // kg, of the body in the third record

  explicit Weighing(std::uint64_t seed) : machine(seed) {
    Random random(seed + 50);
    machine.declared.common_error = 0.15;
    const double scale = random.uniform(0.8, 1.2);
    for (JointDrive& drive : machine.drives) drive.constant *= scale;
    other = random.uniform(1.5, 4);
    add(machine.record(10 * seed));
    add(with(2.5, {0.03, -0.08, 0.15}).record(10 * seed + 1));
    add(with(other, {-0.05, 0.04, 0.1}).record(10 * seed + 2));
  }

  test::Machine with(double mass, const Eigen::Vector3d& centre) const {
    test::Machine loaded = machine;
    Body body;
    body.mass = mass, body.centre = centre, body.inertia = 0.004 * Eigen::Matrix3d::Identity();
    loaded.chain.links[5] += parameters_of(body);
    return loaded;
  }

  void add(const ArmRecord& record) {
    std::vector<std::string> warnings;
    records.push_back(motions_of(record, machine.declared, warnings));
  }
};

const Carried kUnknown = {{0, kNaN}};

void expect_near(const signal::Measured& m, double truth, double errors, const std::string& what) {
  EXPECT_LT(std::fabs(m.value - truth), errors * m.standard_error)
      << what << ": " << m.value << " +- " << m.standard_error << ", true " << truth;
}

/// The goal: the mass of another body within 2 %, and within its errors; beyond 3 once in 370.
void expect_weighed(std::uint64_t seed) {
  const Weighing w(seed);
  const ArmFit fit = fit_records(w.machine.declared, w.records, {}, nullptr,
                                 {std::nullopt, Carried{{2.5, 0.0025}}, kUnknown});
  EXPECT_TRUE(fit.weighed);
  EXPECT_TRUE(fit.contradictions.empty());
  ASSERT_EQ(fit.states.size(), 2u);
  expect_near(fit.states[1].mass, w.other, 3, "mass of the other body");
  EXPECT_NEAR(fit.states[1].mass.value, w.other, 0.02 * w.other) << seed;
  EXPECT_TRUE(is_consistent(fit.states[1].payload));
  EXPECT_LT(fit.rig.common_error, w.machine.declared.common_error);
  for (std::size_t j = 0; j < 6; ++j) {
    const JointDrive& truth = w.machine.drives[j];
    expect_near(fit.drives[j][kDriveTerms], truth.constant, 4, truth.name);
    if (j == 1 || j == 2)  // which carry the weight; they were up to 30 % off
      EXPECT_NEAR(fit.drives[j][kDriveTerms].value, truth.constant, 0.03 * truth.constant) << truth.name;
  }
}

TEST(KnownWeight, MeasuresTheTorqueConstantsAndThenOtherBodies) {
  expect_weighed(2);
}

TEST(KnownWeight, OfDrawnArms) {
  for (const std::uint64_t seed : {1, 3, 5, 6}) expect_weighed(seed);
}

TEST(KnownWeight, WithoutItTheScaleIsTheDeclaredOneAndTheIntervalHoldsTheTruth) {
  const Weighing w(4);
  const ArmFit fit =
      fit_records(w.machine.declared, w.records, {}, nullptr, {std::nullopt, kUnknown, kUnknown});
  EXPECT_FALSE(fit.weighed);
  for (int s = 0; s < 2; ++s) {
    const signal::Measured& mass = fit.states[std::size_t(s)].mass;
    expect_near(mass, s == 0 ? 2.5 : w.other, 2, "mass");
    EXPECT_GT(mass.standard_error,
              0.12 * mass.value);  // of 0.15 declared; the offsets of the constants add some
  }
}

TEST(KnownWeight, AWrongOneIsSaid) {
  const Weighing w(2);
  const std::vector<RecordMotions> two = {w.records[0], w.records[1]};
  const ArmFit fit = fit_records(w.machine.declared, two, {}, nullptr, {std::nullopt, Carried{{25, 0.02}}});
  bool said = false;
  for (const std::string& warning : fit.warnings)
    said = said || warning.find("check the weight") != std::string::npos;
  EXPECT_TRUE(said);
  EXPECT_THROW(fit_records(w.machine.declared, {w.records[1]}, {}, nullptr, {Carried{{2.5, 0.01}}}),
               CannotIdentify);
}

}  // namespace
}  // namespace backlash::arm
