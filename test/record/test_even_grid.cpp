// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/record/even_grid.h"
#include "backlash_diagnosis/record/resampling.h"

namespace backlash::record {
namespace {

Record line(const std::vector<double>& times) {
  Record r;
  r.time = times;
  for (const double t : times) r.column(Channel::motor_position).push_back(3 * t);
  return r;
}

// A straight line is its own interpolation.
TEST(EvenGrid, GivesLostSamplesTheirRows) {
  const EvenGrid even = even_grid(line({0, 1, 2, 5, 6, 8, 9, 10, 11, 12}));
  ASSERT_EQ(even.record.size(), 13u);
  for (std::size_t i = 0; i < 13; ++i) {
    EXPECT_NEAR(even.record.time[i], double(i), 1e-14);  // rounding
    EXPECT_NEAR(even.record.column(Channel::motor_position)[i], 3.0 * double(i), 4e-14);
    EXPECT_EQ(even.lost[i], i == 3 || i == 4 || i == 7) << i;
  }
  EXPECT_TRUE(even.whole(8, 5));
  EXPECT_TRUE(even.whole(5, 2));
  EXPECT_FALSE(even.whole(5, 3));
  EXPECT_TRUE(even.whole(3, 0));
}

// An interval alone does not show whether the sample after it is late or one before it was lost: jitter of a
// tenth (a fifth) of an interval makes one of 2500 (13) half as long again, or half as short.
TEST(EvenGrid, LateSamplesAreNotLost) {
  for (const double jitter : {0.1, 0.2}) {
    Random random(7);
    std::vector<double> times;
    std::vector<std::size_t> rows;
    for (std::size_t row = 0; row < 20000; ++row) {
      if (row > 0 && random.uniform() < 0.005) continue;
      times.push_back(double(row) + std::clamp(jitter * random.normal(), -0.49, 0.49));
      rows.push_back(row);
    }
    const std::vector<std::size_t> found = rows_of_samples(times, 1);
    std::size_t differ = 0, rounded = 0;
    for (std::size_t i = 1; i < rows.size(); ++i) {
      const std::size_t apart = rows[i] - rows[i - 1];
      differ += found[i] - found[i - 1] != apart;
      rounded += std::size_t(std::max(1.0, std::round(times[i] - times[i - 1]))) != apart;
    }
    EXPECT_LT(differ, rounded) << jitter;
    // A row too many moves all samples behind it; by rounding there are, in simulation, 6 and
    // 748.
    EXPECT_NEAR(double(found.back()), double(rows.back()), 0) << jitter;
  }
}

// A cubic is its own interpolation, but beside the ends, where it is a line; a torque that jumps does not
// overshoot.
TEST(EvenGrid, APositionGoesOnAsItWas) {
  Record r;
  r.time = {0, 1, 3, 4, 7, 8, 9, 10, 11};
  for (const double t : r.time) {
    r.column(Channel::motor_position).push_back(t * t * t - 7 * t * t);
    r.column(Channel::motor_torque).push_back(t < 5 ? -1 : 1);
  }
  const EvenGrid even = even_grid(r);
  ASSERT_EQ(even.record.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) {
    const auto t = double(i);
    EXPECT_NEAR(even.record.column(Channel::motor_position)[i], t * t * t - 7 * t * t, 1e-12) << i;
    EXPECT_LE(std::fabs(even.record.column(Channel::motor_torque)[i]), 1);
  }
}

/// A fast sine, sampled at times that are off an even grid by up to a tenth, one of a hundred lost.
struct Jittered {
  Record stamped, counted;  // taken at the stamps; taken evenly, stamped as the other
  static double motion(double t) { return 0.3 * std::sin(2 * M_PI * 25 * t); }

  Jittered() {
    Random random(2);
    for (int i = 0; i < 2000; ++i) {
      const double even = 1e-3 * i, taken = even + 1e-4 * random.uniform(-1, 1);
      if (random.uniform(0, 1) < 0.01 && i > 0) continue;
      stamped.time.push_back(taken), counted.time.push_back(taken);
      stamped.column(Channel::motor_position).push_back(motion(taken));
      counted.column(Channel::motor_position).push_back(motion(even));
    }
  }
};

// The positions say whether they were taken at their stamps. Cubics between samples of 25 Hz at 1 kHz are off
// by (2 pi 25 / 1000)^4 3 / 128 of the amplitude at most, 6e-4 of it; across a lost sample by 16 times that.
TEST(EvenGrid, SamplesAreTakenAtTheirStampsOrEvenly) {
  const Jittered jittered;
  for (const bool counted : {false, true}) {
    const EvenGrid even = even_grid(counted ? jittered.counted : jittered.stamped);
    ASSERT_EQ(even.record.size(), 2000u);
    for (std::size_t i = 2; i + 2 < even.record.size(); ++i) {
      EXPECT_NEAR(even.record.time[i] - even.record.time[i - 1], 1e-3, 1e-6);
      const double t = counted ? 1e-3 * double(i) : even.record.time[i];
      EXPECT_NEAR(even.record.column(Channel::motor_position)[i], Jittered::motion(t),
                  0.3 * 6e-4 * (even.lost[i] ? 16 : 1))
          << i << " " << counted;
    }
  }
}

// A machine that was stopped: its clock begins anew between the rows, and the stamps of both parts jitter.
TEST(EvenGrid, BehindALongGapTheRowsBeginAnew) {
  for (const double phase : {0.0, 0.2, 0.4, 0.5, 0.7}) {
    Random random(5);
    Record r;
    for (int i = 0; i < 4000; ++i) {
      const double taken = 2e-3 * (i < 2000 ? i : i + 500 + phase);
      r.time.push_back(taken + 2e-3 * std::clamp(0.05 * random.normal(), -0.2, 0.2));
      r.column(Channel::motor_position).push_back(0.3 * std::sin(2 * M_PI * taken));
    }
    const std::vector<std::size_t> rows = rows_of_samples(r.time, r.sampling_interval());
    EXPECT_EQ(rows[1999], 1999u);
    EXPECT_NEAR(double(rows[2000]), 2500 + phase, 0.7);
    EXPECT_EQ(rows[3999] - rows[2000], 1999u) << phase;
    const SamplingTimes times = sampling_times(r);
    EXPECT_LT(times.stamped, 0.02) << phase;
    for (int i = 0; i < 4000;
         ++i)  // 2000 samples determine where a part is to 0.05 / sqrt(2000), at its end twice
      EXPECT_NEAR(times.time[std::size_t(i)], 2e-3 * (i < 2000 ? i : i + 500 + phase), 2e-3 * 0.01) << i;
  }
}

// Samples that are late by 0.05 of an interval, stamped with an error of 0.2 besides: of what a stamp is off
// the even base the sample was by 0.05^2 / (0.05^2 + 0.2^2), and of the first 0.05^2 0.2^2 / (0.05^2 + 0.2^2)
// remain, of which a motion as smooth as this one leaves what is as slow as a parabola over nine samples,
// 0.255 of the variance. Of 4000 samples that go 0.6 to and fro at 2 Hz the share has an error below 0.01.
TEST(EvenGrid, SamplesThatAreLateAndStampedLateAsWell) {
  Random random(3);
  Record r;
  for (int i = 0; i < 4000; ++i) {
    const double late = 0.05 * random.normal(), stamped = 0.2 * random.normal();
    r.time.push_back(2e-3 * (i + std::clamp(late + stamped, -0.49, 0.49)));
    r.column(Channel::motor_position).push_back(0.3 * std::sin(2 * M_PI * 2 * 2e-3 * (i + late)));
  }
  const SamplingTimes times = sampling_times(r);
  EXPECT_NEAR(times.stamped, 0.0588, 0.01);
  EXPECT_NEAR(times.unsure, 2e-3 * 0.0485 * std::sqrt(0.255), 2e-3 * 0.004);
  r.time = times.time, r.unsure_time = times.unsure;
  EXPECT_EQ(sampling_times(r).time, times.time);  // once is enough
}

// Of motor and load, which swing against each other at 40 Hz, as heavy as each other: their mean is smooth,
// so that it shows each sample's own time but for what is as slow as a parabola over nine samples (0.255 of
// the variance) and the speed does not show about its turns. Of the motor alone, which swings by ten times
// what it moves in the time that a sample is late, hardly anything shows it.
TEST(EvenGrid, BothPositionsShowWhenASampleWasTaken) {
  for (const bool both : {false, true}) {
    Random random(4);
    Record r;
    std::vector<double> taken, rate;
    for (int i = 0; i < 8000; ++i) {
      const double late = 0.05 * random.normal(), stamped = 0.2 * random.normal();
      r.time.push_back(2e-3 * (i + std::clamp(late + stamped, -0.49, 0.49)));
      taken.push_back(2e-3 * (i + late));
      const double slow = 2 * M_PI * 0.5, fast = 2 * M_PI * 40, swing = 2e-3 * std::sin(fast * taken.back());
      const double mean = 0.3 * std::sin(slow * taken.back());
      r.column(Channel::motor_position).push_back(mean + swing);
      if (both) r.column(Channel::load_position).push_back(mean - swing);
      rate.push_back(std::cos(slow * taken.back()));
    }
    const SamplingTimes times = sampling_times(r);
    EXPECT_EQ(rows_of_samples(r.time, r.sampling_interval()).back(), 7999u);
    double squares = 0, count = 0;
    for (std::size_t i = 10; i + 10 < taken.size(); ++i)
      if (std::fabs(rate[i]) > 0.5) squares += std::pow(times.time[i] - taken[i], 2), ++count;
    const double left = std::sqrt(squares / count) / 2e-3;
    if (both)
      EXPECT_NEAR(left, 0.0485 * std::sqrt(0.255), 0.004);
    else  // a little, where the swing turns
      EXPECT_TRUE(left > 0.8 * 0.0485 && left < 0.0485 + 0.004) << left;
    EXPECT_NEAR(times.unsure / 2e-3, left, 0.008);  // of a share of 0.059 +- 0.01, the larger
  }
}

// A straight line is its own interpolation.
TEST(EvenGrid, AStretchThatBeginsBetweenTheRowsIsInterpolated) {
  const EvenGrid even = even_grid(line({0, 1, 2, 3, 6.4, 7.4, 8.4, 9.4, 10}));
  for (std::size_t i = 0; i < even.record.size(); ++i)
    EXPECT_NEAR(even.record.column(Channel::motor_position)[i], 3 * even.record.time[i], 1e-12);
}

TEST(EvenGrid, LeavesWholeRecordsAsTheyAre) {
  for (const std::vector<double>& times :
       {std::vector<double>{0, 1, 2, 3, 4}, {0, 1, 2, 3, 1e9}, {0, 1}, {}}) {
    const EvenGrid even = even_grid(line(times));
    EXPECT_EQ(even.record.time, times);
    EXPECT_EQ(even.lost, std::vector<bool>(times.size(), false));
  }
}

/// A position of 1 Hz and a torque, at 100 Hz.
Record wave(std::size_t size, double interval = 0.01) {
  Record r;
  for (std::size_t k = 0; k < size; ++k) {
    const double t = interval * double(k);
    r.time.push_back(t);
    r.column(Channel::motor_position).push_back(std::sin(2 * M_PI * t));
    r.column(Channel::motor_torque).push_back(std::cos(2 * M_PI * t));
  }
  return r;
}

/// Without the rows that are not `kept`.
Record without(const Record& all, const std::function<bool(std::size_t)>& kept) {
  Record r;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (!kept(k)) continue;
    r.time.push_back(all.time[k]);
    for (const Channel channel : {Channel::motor_position, Channel::motor_torque})
      r.column(channel).push_back(all.column(channel)[k]);
  }
  return r;
}

// The cubic through samples 2 h and h before, h and 2 h behind is off by at most 4 (w h)^4 / 4!: 2.6e-6.
TEST(EvenlySampled, LostSamplesAreRowsThatAreNamed) {
  const Record all = wave(300);
  const EvenGrid grid =
      evenly_sampled_grid(without(all, [](std::size_t k) { return k % 50 != 30 && (k < 200 || k >= 220); }));
  ASSERT_EQ(grid.record.size(), all.size());
  for (std::size_t k = 0; k < all.size(); ++k) {
    EXPECT_EQ(grid.lost[k], k % 50 == 30 || (k >= 200 && k < 220)) << k;
    if (k < 200 || k >= 220)
      EXPECT_NEAR(grid.record.column(Channel::motor_position)[k], all.column(Channel::motor_position)[k],
                  2.7e-6);
  }
  EXPECT_THROW(evenly_sampled(without(all, [](std::size_t k) { return k < 200 || k >= 220; })), BadData);
  EXPECT_THROW(evenly_sampled_grid(without(all, [](std::size_t k) { return k < 200 || k >= 260; })), BadData);
}

// Stamps that are late by up to a fifth of an interval: the cubic follows the motion, and no line.
TEST(EvenlySampled, LateSamplesCountAtTheirTimes) {
  Record late = wave(300);
  for (std::size_t k = 1; k + 1 < late.size(); ++k) {
    late.time[k] += 0.002 * double(k * 7 % 11) / 11;
    late.column(Channel::motor_position)[k] = std::sin(2 * M_PI * late.time[k]);
  }
  const EvenGrid grid = evenly_sampled_grid(late);
  for (std::size_t k = 2; k + 4 < grid.record.size(); ++k)
    EXPECT_NEAR(grid.record.column(Channel::motor_position)[k], std::sin(2 * M_PI * grid.record.time[k]),
                2e-6);
}

TEST(Resampled, AFasterRecordIsBroughtToTheRateOfTheSlower) {
  const Record fast = wave(1000, 0.004);
  const EvenGrid grid = resampled(fast, 0.01);
  EXPECT_NEAR(grid.record.sampling_interval(), 0.01, 1e-12);
  for (std::size_t k = 20; k + 20 < grid.record.size(); ++k) {
    const double t = grid.record.time[k];
    EXPECT_NEAR(grid.record.column(Channel::motor_position)[k], std::sin(2 * M_PI * t), 1e-6);
    EXPECT_NEAR(grid.record.column(Channel::motor_torque)[k], std::cos(2 * M_PI * t), 2e-3);  // on a line
  }
  EXPECT_THROW(resampled(fast, 0.001), InvalidParameter);
}

TEST(Resampling, ALongGapCutsARecord) {
  Record r;
  r.name = "run.csv";
  for (int k = 0; k < 1000; ++k)
    if ((k < 300 || k >= 340) && (k < 500 || k >= 560) && (k < 580 || k >= 650)) {
      r.time.push_back(1e-3 * k);
      r.column(Channel::motor_torque).push_back(k);
    }
  const std::vector<Record> parts = parts_between_gaps(r);  // 40 lost rows are no gap, 20 rows no part
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].size(), 460u);
  EXPECT_EQ(parts[1].size(), 350u);
  EXPECT_EQ(parts[1].column(Channel::motor_torque).front(), 650);
  EXPECT_EQ(parts[1].name, "run.csv from 0.65 s");
  ASSERT_EQ(parts[0].warnings.size(), 1u);
  EXPECT_NE(parts[0].warnings[0].find("cut at 2 gaps of more than 0.05 s"), std::string::npos);
  EXPECT_EQ(parts_between_gaps(parts[0]).size(), 1u);
}

}  // namespace
}  // namespace backlash::record
