// SPDX-License-Identifier: BSD-3-Clause
// Oracle: KDL's torques, on which the choice among bodies that move alike must have no influence; and what is
// known of a chain whose first axis is vertical: of its first link only the inertia about that axis shows.
#include <gtest/gtest.h>

#include "arm/regrouping.h"
#include "arm_machines.h"

namespace backlash::arm {
namespace {

TEST(Regrouping, NearestBodiesMoveAlike) {
  const test::Machine machine(3);
  std::vector<std::string> warnings;
  const std::vector<ArmMotion> motions = motions_of(machine.record(7), machine.declared, warnings);
  const Regrouping regrouping(machine.declared.chain, {{&motions[0], 0}});
  const std::vector<BodyParameters>& declared = machine.declared.chain.links;
  Chain near = machine.chain;
  near.links = regrouping.nearest(declared, machine.chain.links);
  const test::Torques as_it_is(machine.chain), chosen(near);
  Random random(5);
  double worst = 0, largest = 0;
  for (int i = 0; i < 50; ++i) {
    const Joints q = test::random_joints(random, 6, 3), v = test::random_joints(random, 6, 2),
                 a = test::random_joints(random, 6, 5);
    worst = std::max(worst, (as_it_is(q, v, a) - chosen(q, v, a)).cwiseAbs().maxCoeff());
    largest = std::max(largest, as_it_is(q, v, a).cwiseAbs().maxCoeff());
  }
  EXPECT_LT(worst, 1e-3 * largest);  // a column that 1e-4 of is left counts as a sum of others
  for (std::size_t i = 0; i < 6; ++i) EXPECT_TRUE(is_consistent(near.links[i])) << i;
  for (std::size_t k = 0; k < 10; ++k) {
    EXPECT_EQ(regrouping.shown()[k], k == 9 ? Shown::leads : Shown::not_at_all) << kStandardNames[k];
    if (k < 9) EXPECT_EQ(near.links[0][Eigen::Index(k)], declared[0][Eigen::Index(k)]) << kStandardNames[k];
  }
  EXPECT_GT(std::fabs(machine.chain.links[0][0] - declared[0][0]), 0.1);  // which it was not before
}

TEST(Regrouping, OfTheDeclaredBodiesTheNearestAreTheseThemselves) {
  const test::Machine machine(1);
  std::vector<std::string> warnings;
  const std::vector<ArmMotion> motions = motions_of(machine.record(8), machine.declared, warnings);
  const Regrouping regrouping(machine.declared.chain, {{&motions[0], 0}});
  const std::vector<BodyParameters>& declared = machine.declared.chain.links;
  const std::vector<BodyParameters> near = regrouping.nearest(declared, declared);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_LT((near[i] - declared[i]).norm(), 1e-6) << i;
}

}  // namespace
}  // namespace backlash::arm
