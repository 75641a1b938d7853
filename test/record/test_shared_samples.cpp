// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/record/shared_samples.h"

namespace backlash::record {
namespace {

/// 4000 samples of a motion with noise of this seed; the sensors see steps of 1e-3.
Record noisy(std::uint64_t seed) {
  Random random(seed);
  Record record;
  for (int i = 0; i < 4000; ++i) {
    record.time.push_back(1e-3 * i);
    record.column(Channel::motor_torque)
        .push_back(std::round(1e3 * (std::sin(0.01 * i) + 0.01 * random.normal())));
    record.column(Channel::motor_position).push_back(std::round(1e3 * std::cos(0.01 * i)));
  }
  return record;
}

TEST(SharedSamples, OfACopyAHalfAndAnother) {
  const Record record = noisy(1);
  EXPECT_EQ(shared_samples(record, record), 1);
  EXPECT_EQ(shared_samples(record.slice(1, 2), record), 1);
  // One of the 64 blocks may lie across the cut.
  EXPECT_NEAR(shared_samples(record, record.slice(0, 2)), 0.5, 1.0 / 64);
  EXPECT_EQ(shared_samples(noisy(2), record), 0);
  Record later = record;  // the same samples, with other stamps
  for (double& t : later.time) t += 100;
  EXPECT_EQ(shared_samples(later, record), 1);
}

TEST(SharedSamples, WhatRestsSaysNothing) {
  Record record = noisy(1);
  for (const Channel channel : {Channel::motor_torque, Channel::motor_position})
    record.column(channel).assign(record.size(), 3);
  EXPECT_TRUE(std::isnan(shared_samples(record, record)));
  record.column(Channel::motor_torque).clear();
  EXPECT_TRUE(std::isnan(shared_samples(record, record)));
  EXPECT_TRUE(std::isnan(shared_samples(noisy(1).slice(0, 0.01), noisy(1))));  // shorter than a block
}

}  // namespace
}  // namespace backlash::record
