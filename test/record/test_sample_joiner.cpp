// SPDX-License-Identifier: BSD-3-Clause
// The oracle is a straight line, which interpolation must give exactly.
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/record/sample_joiner.h"

namespace backlash::record {
namespace {

SampleJoiner::Sample sample(double time, Channel channel, double value) {
  SampleJoiner::Sample s{time, {}};
  s.values.fill(kNaN);
  s.values[static_cast<std::size_t>(channel)] = value;
  return s;
}

double at(const SampleJoiner::Sample& s, Channel channel) {
  return s.values[static_cast<std::size_t>(channel)];
}

SampleJoiner::Sample motor(double time) {
  return sample(time, Channel::motor_position, 10 * time);
}
SampleJoiner::Sample load(double time) {
  return sample(time, Channel::load_position, 3 - time);
}

TEST(SampleJoiner, OneStreamPassesThrough) {
  SampleJoiner joiner(1);
  joiner.add(0, motor(0.5));
  const auto s = joiner.next();
  ASSERT_TRUE(s.has_value());
  EXPECT_EQ(s->time, 0.5);
  EXPECT_EQ(at(*s, Channel::motor_position), 5);
  EXPECT_TRUE(std::isnan(at(*s, Channel::load_position)));
  EXPECT_FALSE(joiner.next().has_value());
}

TEST(SampleJoiner, ReadsAnotherRateAtTheStampsOfTheFirst) {
  SampleJoiner joiner(2);
  int joined = 0;
  for (int k = 0; k <= 1000; ++k) {  // 1 kHz and 250 Hz + 0.7 ms
    joiner.add(0, motor(1e-3 * k));
    if (k % 4 == 0) joiner.add(1, load(1e-3 * k + 0.7e-3));
    while (const auto s = joiner.next()) {
      EXPECT_NEAR(at(*s, Channel::load_position), 3 - s->time, 1e-12);  // roundings
      EXPECT_NEAR(at(*s, Channel::motor_position), 10 * s->time, 1e-12);
      ++joined;
    }
  }
  EXPECT_EQ(joined, joiner.counters().joined);
  EXPECT_EQ(joiner.counters().alone, 1);  // before the first of the other
  EXPECT_GE(joined, 995);
}

TEST(SampleJoiner, WaitsForTheOtherAndNoLongerThanItMay) {
  SampleJoiner joiner(2, 0.1);
  joiner.add(1, load(0));
  joiner.add(0, motor(0.01));
  EXPECT_FALSE(joiner.next().has_value());
  joiner.add(1, load(0.02));
  EXPECT_TRUE(joiner.next().has_value());
  for (int k = 3; k < 40; ++k) joiner.add(0, motor(0.01 * k));  // the other is silent
  EXPECT_FALSE(joiner.next().has_value());
  EXPECT_GT(joiner.counters().alone, 20);
}

TEST(SampleJoiner, InterpolatesOverNoGap) {
  SampleJoiner joiner(2, 10);
  for (int k = 0; k < 100; ++k) joiner.add(1, load(0.01 * k));
  joiner.add(1, load(2));
  for (int k = 0; k < 200; ++k) joiner.add(0, motor(0.01 * k + 0.005));
  while (const auto s = joiner.next()) EXPECT_LT(s->time, 0.99);
  EXPECT_EQ(joiner.counters().joined, 99);
  EXPECT_EQ(joiner.counters().alone, 101);
}

TEST(SampleJoiner, GoesOnAfterAClockThatWentBack) {
  SampleJoiner joiner(2);
  for (const double from : {100.0, 0.0})
    for (int k = 0; k < 50; ++k) {
      joiner.add(0, motor(from + 0.01 * k));
      joiner.add(1, load(from + 0.01 * k));
      while (const auto s = joiner.next()) EXPECT_NEAR(at(*s, Channel::load_position), 3 - s->time, 1e-12);
    }
  EXPECT_GE(joiner.counters().restarts, 1);
  EXPECT_GE(joiner.counters().joined, 96);
}

TEST(SampleJoiner, RefusesNoStreamAndNoTime) {
  EXPECT_THROW(SampleJoiner(0), InvalidParameter);
  EXPECT_THROW(SampleJoiner(2, 0), InvalidParameter);
  SampleJoiner joiner(1);
  EXPECT_THROW(joiner.add(0, motor(kNaN)), InvalidParameter);
}

TEST(SampleJoiner, JoinsRecordsAndSaysWhatItLeftOut) {
  Record motor_part, load_part;
  motor_part.name = "run.bag";
  for (int k = 0; k < 100; ++k) {
    motor_part.time.push_back(0.01 * k);
    motor_part.column(Channel::motor_position).push_back(0.1 * k);
    if (k < 20 || k > 40) {
      load_part.time.push_back(0.01 * k + 0.002);
      load_part.column(Channel::load_position).push_back(3 - (0.01 * k + 0.002));
    }
  }
  const Record all = joined({motor_part, load_part});
  EXPECT_EQ(all.name, "run.bag");
  ASSERT_TRUE(all.has(Channel::load_position));
  for (std::size_t i = 0; i < all.size(); ++i)
    EXPECT_NEAR(all.column(Channel::load_position)[i], 3 - all.time[i], 1e-12);
  EXPECT_EQ(all.size(), 77u);  // of 100: one at the start, 20 to 41 in the gap
  ASSERT_EQ(all.warnings.size(), 1u);
  EXPECT_NE(all.warnings.front().find("23 of 100 samples left out"), std::string::npos)
      << all.warnings.front();
  Record later = load_part;
  for (double& time : later.time) time += 100;
  EXPECT_THROW(joined({motor_part, later}), BadData);
}

// A stretch that is cut out of all joints by the times of one must lie where that one has it.
TEST(SampleJoiner, AnotherTimeZeroMovesNoSample) {
  Record late;
  late.origin = 1003.5;
  late.time = {0, 0.25, 0.5};
  late.column(Channel::motor_position) = {1, 2, 3};
  late.repeated_stamps = 1;
  late.first_repeated_stamp = 0.25;
  set_origin(late, 1002);
  EXPECT_EQ(late.time, (std::vector<double>{1.5, 1.75, 2}));
  EXPECT_EQ(late.first_repeated_stamp, 1.75);
  EXPECT_EQ(late.origin, 1002);
  EXPECT_EQ(late.slice(1.75, 2).column(Channel::motor_position), std::vector<double>{2});
}

// Two controllers of an arm, each with a time zero and stamps of its own: q = t and 2 t of one clock.
TEST(SampleJoiner, JointsOfTwoControllersGetOneTimeBase) {
  std::vector<Record> joints(2);
  for (std::size_t j = 0; j < 2; ++j) {
    joints[j].origin = 1000 + 1.503 * double(j);
    for (int k = 0; k < 500; ++k) {
      joints[j].time.push_back(0.01 * k);
      joints[j].column(Channel::motor_position).push_back((1 + double(j)) * (joints[j].origin + 0.01 * k));
    }
  }
  const std::vector<Record> same(2, joints[0]);
  std::vector<Record> untouched = same;
  share_time_base(untouched);
  EXPECT_EQ(untouched[1].column(Channel::motor_position), same[1].column(Channel::motor_position));
  EXPECT_TRUE(untouched[0].warnings.empty());

  share_time_base(joints);
  EXPECT_EQ(joints[0].time, joints[1].time);
  EXPECT_EQ(joints[0].size(), 349u);  // of 500: from 1.51 s on
  for (std::size_t k = 0; k < joints[0].size(); ++k) {
    EXPECT_NEAR(joints[0].column(Channel::motor_position)[k], 1000 + joints[0].time[k], 1e-9);
    EXPECT_NEAR(joints[1].column(Channel::motor_position)[k], 2 * (1000 + joints[1].time[k]), 1e-9);
  }
  ASSERT_EQ(joints[0].warnings.size(), 1u);
  EXPECT_NE(joints[0].warnings[0].find("151 of 500 samples (1.51 s) left out"), std::string::npos)
      << joints[0].warnings[0];
  joints[1].origin += 100;
  EXPECT_THROW(share_time_base(joints), BadData);
}

}  // namespace
}  // namespace backlash::record
