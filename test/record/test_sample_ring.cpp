// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/record/sample_ring.h"

namespace backlash::record {
namespace {

RingSettings settings() {
  RingSettings s;
  s.channels = {Channel::motor_torque, Channel::motor_position};
  s.window = 10;
  s.longest_gap = 60;
  return s;
}

ChannelValues values(double torque, double position) {
  ChannelValues v;
  v.fill(kNaN);
  v[static_cast<std::size_t>(Channel::motor_torque)] = torque;
  v[static_cast<std::size_t>(Channel::motor_position)] = position;
  return v;
}

/// Samples each 0.1 s at [from, to).
void feed(SampleRing& ring, double from, double to) {
  for (int k = 0; from + 0.1 * k < to - 1e-9; ++k) ring.add(from + 0.1 * k, values(k, 2 * k));
}

TEST(SampleRing, KeepsTheNewest) {
  SampleRing ring(settings());
  feed(ring, 0, 100);
  // The window, and at most 5 % more before it is forgotten.
  EXPECT_NEAR(ring.end(), 99.9, 1e-9);
  EXPECT_GE(ring.length(), 10 - 0.11);
  EXPECT_LE(ring.length(), 10.5 + 1e-9);
  const Record kept = ring.kept();
  ASSERT_EQ(kept.column(Channel::motor_position).size(), kept.size());
  EXPECT_EQ(kept.column(Channel::motor_torque).back(), 999);
  EXPECT_EQ(kept.column(Channel::motor_position).back(), 1998);
  EXPECT_FALSE(kept.has(Channel::load_position));
}

TEST(SampleRing, KeepsAcrossARestAndForgetsAtAJump) {
  SampleRing ring(settings());
  feed(ring, 0, 5);
  ring.add(12, values(1, 1));  // 7 s of silence
  EXPECT_EQ(ring.counters().restarts, 0);
  EXPECT_EQ(ring.kept().size(), 31u);  // 2.0 to 4.9 and 12
  ring.add(80, values(1, 1));          // more than the longest gap
  EXPECT_EQ(ring.counters().restarts, 1);
  EXPECT_EQ(ring.kept().size(), 1u);
  feed(ring, 3, 4);  // a bag that begins again
  EXPECT_EQ(ring.counters().restarts, 2);
  EXPECT_EQ(ring.counters().last_jump, "the clock jumped by -77 s");
  EXPECT_EQ(ring.kept().size(), 10u);
}

TEST(SampleRing, LeavesOutAndCounts) {
  SampleRing ring(settings());
  EXPECT_TRUE(ring.add(1, values(1, 1)));
  EXPECT_FALSE(ring.add(1, values(1, 1)));
  EXPECT_FALSE(ring.add(0.5, values(1, 1)));
  EXPECT_FALSE(ring.add(2, values(kNaN, 1)));
  EXPECT_THROW(ring.add(kNaN, values(1, 1)), InvalidParameter);
  EXPECT_TRUE(ring.add(3, values(1, 1)));
  EXPECT_EQ(ring.counters().repeated, 1);
  EXPECT_EQ(ring.counters().late, 1);
  EXPECT_EQ(ring.counters().not_a_number, 1);
  EXPECT_EQ(ring.counters().taken, 2);
  EXPECT_EQ(ring.counters().restarts, 0);
  RingSettings wrong = settings();
  wrong.window = 0;
  EXPECT_THROW(SampleRing{wrong}, InvalidParameter);
}

}  // namespace
}  // namespace backlash::record
