// SPDX-License-Identifier: BSD-3-Clause
// Columns that are made together are those that are made one by one, from the formulas.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "changes/change_effects.h"

namespace backlash::changes {
namespace {

record::Record made() {
  record::Record r;
  r.name = "made";
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, 0.05);
  for (double t = 0; t < 60; t += 0.01) {
    const double q = 0.9 * std::sin(0.7 * t) + 0.4 * std::sin(1.9 * t + 1);
    r.time.push_back(t);
    r.column(record::Channel::motor_position).push_back(q);
    r.column(record::Channel::motor_torque).push_back(std::sin(q) + noise(random));
  }
  return r;
}

TEST(EffectColumns, MadeTogetherAreThoseMadeOneByOne) {
  const record::Record record = made();
  const ChangeSettings settings;
  const MotionSampling sampling = sampling_of({&record}, settings);
  const SampledMotion together = sampled_motion(record, sampling, settings);
  const std::vector<ChangeEffect> effects = change_effects(together.sampling);
  prepare_columns(together, effects);
  ASSERT_GT(together.known_columns.size(), 150U);
  for (const ChangeEffect& e : effects) {
    const SampledMotion alone = sampled_motion(record, sampling, settings);
    // 160 turns by one half each, 1e-16 of rounding a turn, and what a filter of gain 1 makes of it.
    EXPECT_LT((*effect_columns(together, e) - *effect_columns(alone, e)).cwiseAbs().maxCoeff(), 1e-12)
        << e.name();
  }
}

}  // namespace
}  // namespace backlash::changes
