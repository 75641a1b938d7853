// SPDX-License-Identifier: BSD-3-Clause
// A motion in closed form, recorded by sensors of known resolution, and then spoilt in a known way: what was
// done to it, and where, is the oracle.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/record/record_check.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::record {
namespace {

constexpr double kInterval = 2e-3, kDuration = 20;   // s
constexpr double kStep = 7e-6, kMotorStep = 8.7e-7;  // rad, of the encoders
constexpr double kGap = 5e-4, kNoise = 2;            // rad, N m

double rounded(double x, double step) {
  return step * std::round(x / step);
}

double position(double t) {
  return 0.3 * std::sin(2 * M_PI * 0.5 * t) + 0.1 * std::sin(2 * M_PI * 1.3 * t + 1);
}

/// The torque moves 114 kg m^2 against friction; the load lies on the flank that its acceleration says.
void add_sample(Record& r, double stamp, double t, Random& random) {
  const double h = 1e-4, q = position(t), w = (position(t + h) - position(t - h)) / (2 * h),
               a = (position(t + h) - 2 * q + position(t - h)) / (h * h);
  r.time.push_back(stamp);
  r.column(Channel::motor_torque)
      .push_back(114 * a + 13 * w + 60 * std::tanh(w / 1e-3) + kNoise * random.normal());
  r.column(Channel::motor_position).push_back(rounded(q + 0.5 * kGap * std::tanh(a / 0.05), kMotorStep));
  r.column(Channel::load_position).push_back(rounded(q, kStep));
}

/// `sampled(k)` is when sample k was taken, `stamped(k)` what its stamp says.
Record recorded(const std::function<double(int)>& sampled, const std::function<double(int)>& stamped) {
  Record r;
  r.name = "run.csv";
  Random random(3);
  for (int k = 0; k * kInterval < kDuration; ++k) add_sample(r, stamped(k), sampled(k), random);
  return r;
}

Record healthy() {
  const auto even = [](int k) { return k * kInterval; };
  return recorded(even, even);
}

DeclaredMotion servo() {
  DeclaredMotion declared;
  declared.known = declared.free_load = declared.through_teeth = true;
  declared.motor_inertia = 6, declared.load_inertia = 108;
  declared.looseness = [](double) { return 1e-3; };
  declared.resonance = [](double) { return 44.0; };
  return declared;
}

const Finding* find(const RecordCheck& check, FindingKind kind) {
  for (const Finding& finding : check.findings)
    if (finding.kind == kind) return &finding;
  return nullptr;
}

std::string messages(const RecordCheck& check) {
  std::string all;
  for (const Finding& finding : check.findings) all += finding.message + "\n";
  return all;
}

void erase_row(Record& r, std::size_t row) {
  const auto erase = [row](std::vector<double>& values) {
    if (!values.empty()) values.erase(values.begin() + std::ptrdiff_t(row));
  };
  erase(r.time);
  for (const Channel channel : kChannels) erase(r.column(channel));
}

TEST(RecordCheck, FindsNothingInASoundRecord) {
  const CheckedRecord checked = check_record(healthy(), servo());
  EXPECT_EQ(messages(checked.check), "");
  ASSERT_EQ(checked.check.channels.size(), 3u);
  const ChannelState& load = checked.check.channels[2];
  EXPECT_EQ(load.channel, Channel::load_position);
  EXPECT_NEAR(load.rate, 1 / kInterval, 1e-6);
  EXPECT_NEAR(load.resolution, kStep, 1e-9);
  const ChannelState& torque = checked.check.channels[0];
  EXPECT_NEAR(torque.noise, kNoise, 0.2);  // of 10000 samples; the friction's sign adds to few
  ASSERT_EQ(checked.check.usable.size(), 1u);
  EXPECT_EQ(checked.record.time, healthy().time);
}

TEST(RecordCheck, CountsLostSamplesAndSaysWhere) {
  Record r = healthy();
  erase_row(r, 7000);
  for (int k = 0; k < 20; ++k) erase_row(r, 2500);
  const CheckedRecord checked = check_record(r, servo());
  const Finding* const lost = find(checked.check, FindingKind::lost_samples);
  ASSERT_NE(lost, nullptr);
  EXPECT_EQ(lost->count, 21u);
  EXPECT_NEAR(lost->from, 2499 * kInterval, 1e-9);
  EXPECT_NEAR(lost->to, 7001 * kInterval, 1e-9);
  EXPECT_EQ(checked.check.findings.size(), 1u) << messages(checked.check);
  EXPECT_EQ(lost->consequence, Consequence::noted);
}

TEST(RecordCheck, ALateSampleIsNotALostOne) {
  Record r = healthy();
  r.time[4000] += 0.7 * kInterval;
  EXPECT_EQ(find(check_record(r, servo()).check, FindingKind::lost_samples), nullptr);
}

TEST(RecordCheck, ACounterOfRepeatedStampsIsPassedOn) {
  Record r = healthy();
  r.repeated_stamps = 4, r.first_repeated_stamp = 1.5;
  const CheckedRecord checked = check_record(r, servo());
  const Finding* const repeated = find(checked.check, FindingKind::repeated_stamps);
  ASSERT_NE(repeated, nullptr);
  EXPECT_EQ(repeated->count, 4u);
}

// The motion goes on by one sample while the stamps go on by half a second.
TEST(RecordCheck, DistinguishesAStepOfTheClockFromLostSamples) {
  const auto stamped = [](int k) { return k * kInterval + (k > 5000 ? 0.5 : 0); };
  const CheckedRecord checked = check_record(recorded([](int k) { return k * kInterval; }, stamped), servo());
  const Finding* const step = find(checked.check, FindingKind::clock_step);
  ASSERT_NE(step, nullptr) << messages(checked.check);
  EXPECT_NEAR(step->from, 10, 1e-9);
  EXPECT_EQ(find(checked.check, FindingKind::lost_samples), nullptr);
  EXPECT_EQ(checked.check.usable.size(), 2u);
}

TEST(RecordCheck, CutsWhereTheStampsOfTheFileWentBack) {
  const auto stamped = [](int k) { return k * kInterval + (k > 5000 ? 0.5 : 0); };
  Record r = recorded([](int k) { return k * kInterval + (k > 5000 ? 7 : 0); }, stamped);  // another motion
  r.clock_steps = {{r.time[5001], 3}};
  const CheckedRecord checked = check_record(r, servo());
  const Finding* const step = find(checked.check, FindingKind::clock_step);
  ASSERT_NE(step, nullptr) << messages(checked.check);
  EXPECT_EQ(find(checked.check, FindingKind::lost_samples), nullptr) << messages(checked.check);
  ASSERT_EQ(checked.check.usable.size(), 2u);
  EXPECT_NEAR(checked.check.usable[1].from, 5001 * kInterval + 0.5, 1e-9);
}

/// Uniform, of so much of an interval to either side.
std::vector<double> jitter(double share) {
  Random random(5);
  std::vector<double> out;
  for (int k = 0; k * kInterval < kDuration; ++k)
    out.push_back(share * kInterval * (2 * random.uniform() - 1));
  return out;
}

TEST(RecordCheck, DistinguishesStampsThatJitterFromSamplesThatAreLate) {
  const std::vector<double> late = jitter(0.2);
  const auto even = [](int k) { return k * kInterval; };
  const auto uneven = [&](int k) { return k * kInterval + late[std::size_t(k)]; };
  const CheckedRecord stamps = check_record(recorded(even, uneven), servo());
  EXPECT_TRUE(stamps.check.stamps.of_stamps_only);
  ASSERT_TRUE(stamps.check.stamps.evened);
  for (std::size_t k = 0; k < stamps.record.size(); ++k)  // 0.2 of 2 ms, averaged over 10000 samples
    ASSERT_NEAR(stamps.record.time[k], double(k) * kInterval, 2e-5);
  const CheckedRecord samples = check_record(recorded(uneven, uneven), servo());
  EXPECT_FALSE(samples.check.stamps.of_stamps_only);
  EXPECT_NEAR(samples.record.time[77], uneven(77), 1e-12);
}

// A machine that falls through its play as a part begins: over the gap before it no speed is known.
TEST(RecordCheck, AQuickBeginBehindAGapIsNoJump) {
  const auto stamped = [](int k) { return k * kInterval + (k > 5000 ? 1 : 0); };
  for (const bool gap : {true, false}) {
    Record r = gap ? recorded([](int k) { return k * kInterval; }, stamped) : healthy();
    const double before = r.column(Channel::load_position)[5000];
    for (std::size_t k = 5001; k < 5003; ++k) r.column(Channel::load_position)[k] = before;
    for (std::size_t k = 5003; k < r.size(); ++k) r.column(Channel::load_position)[k] += 0.02;
    const CheckedRecord checked = check_record(r, servo());
    EXPECT_EQ(checked.check.jumps.empty(), gap) << messages(checked.check);
  }
}

TEST(RecordCheck, FindsAJumpWithItsSizeAndCutsThere) {
  for (const double size : {0.003, -0.003, 0.5236}) {
    Record r = healthy();
    for (std::size_t k = 4000; k < r.size(); ++k) r.column(Channel::load_position)[k] += size;
    const CheckedRecord checked = check_record(r, servo());
    ASSERT_EQ(checked.check.jumps.size(), 1u) << size << messages(checked.check);
    const Jump& jump = checked.check.jumps[0];
    EXPECT_EQ(jump.channel, Channel::load_position);
    EXPECT_NEAR(jump.after, 4000 * kInterval, 1e-9);
    EXPECT_NEAR(jump.size.value, size, 2e-5);  // three steps of the encoder
    ASSERT_EQ(checked.check.usable.size(), 2u);
    EXPECT_NEAR(longest_stretch(checked.check).from, jump.after, 1e-9);
    const Record without = without_jumps(checked.record, checked.check.jumps);
    EXPECT_NEAR(without.column(Channel::load_position).back(),
                healthy().column(Channel::load_position).back(), 2e-5);
  }
}

TEST(RecordCheck, LosesTheRowOfAWildSample) {
  for (const Channel channel : {Channel::motor_position, Channel::motor_torque}) {
    Record r = healthy();
    const double off = 20 * signal::peak_to_peak(r.column(channel));
    for (const std::size_t row : {1000, 3000, 3001, 5000}) r.column(channel)[row] += off;
    const CheckedRecord checked = check_record(r, servo());
    const Finding* const wild = find(checked.check, FindingKind::jump);
    ASSERT_NE(wild, nullptr);
    EXPECT_EQ(wild->consequence, Consequence::mended);
    EXPECT_EQ(wild->count, 4u);
    EXPECT_TRUE(checked.check.jumps.empty());
    ASSERT_EQ(checked.record.size(), r.size() - 4);
    EXPECT_EQ(checked.record.time[3000 - 1], r.time[3002]);
    EXPECT_EQ(checked.record.column(channel)[3000 - 1], r.column(channel)[3002]);
  }
}

// A kick of 20000 N m over two samples, as of a speed loop whose target steps: 114 kg m^2 gain 0.7 rad/s.
TEST(RecordCheck, KeepsATorqueThatTheMotorFeels) {
  Record r = healthy();
  for (const std::size_t row : {2000, 4000, 6000}) {
    r.column(Channel::motor_torque)[row] += 20000, r.column(Channel::motor_torque)[row + 1] += 20000;
    for (std::size_t k = row; k < r.size(); ++k) {
      const double since = double(k - row) * kInterval, pulse = 2 * kInterval;
      const double way = 20000.0 / 114 * (k - row < 2 ? 0.5 * since * since : pulse * (since - 0.5 * pulse));
      for (const Channel channel : {Channel::motor_position, Channel::load_position})
        r.column(channel)[k] += way;
    }
  }
  const CheckedRecord checked = check_record(r, servo());
  EXPECT_EQ(checked.record.size(), r.size()) << messages(checked.check);
}

// One sample of 500 (kRare), each at its own distance.
TEST(RecordCheck, LosesOneWildSampleOf500) {
  Record r = healthy();
  const std::size_t count = r.size() / 500;
  for (std::size_t i = 0; i < count; ++i)
    r.column(Channel::load_position)[250 + 500 * i] += i % 2 == 0 ? 0.5 : -0.3;
  EXPECT_EQ(check_record(r, servo()).record.size(), r.size() - count);
}

TEST(RecordCheck, UnwrapsTurnsAndCounters) {
  const std::vector<double> whole = healthy().column(Channel::load_position);
  for (const double turn : {2 * M_PI, 360.0, 0.25}) {
    Record r = healthy();
    for (double& x : r.column(Channel::load_position)) x -= turn * std::floor(x / turn);
    const CheckedRecord checked = check_record(r, servo());
    const Finding* const wrapped = find(checked.check, FindingKind::wrapped);
    ASSERT_NE(wrapped, nullptr) << turn;
    EXPECT_EQ(wrapped->consequence, Consequence::mended);
    const std::vector<double>& x = checked.record.column(Channel::load_position);
    for (std::size_t k = 0; k < x.size(); ++k)
      ASSERT_NEAR(x[k] - x[0], whole[k] - whole[0], 20 * kStep) << turn;
  }
}

// So many samples are lost that the motor of a joint moves by one of its turns, 2 pi / 110, in that time:
// from where it is fastest on, at each of its passages.
TEST(RecordCheck, MotionAcrossLostSamplesIsNoTurn) {
  DeclaredMotion declared = servo();
  declared.reduction_ratio = 110;
  const double turn = 2 * M_PI / declared.reduction_ratio;
  int tried = 0;
  for (const int begin : {1000, 2510, 4020, 5490, 7010}) {
    Record r = healthy();
    const std::vector<double> q = r.column(Channel::motor_position);
    const auto from = std::size_t(begin);
    std::size_t to = from + 1;
    while (std::fabs(q[to] - q[from]) < turn && to < from + 100) ++to;
    if (to == from + 100) continue;
    ++tried;
    for (std::size_t k = from + 1; k < to; ++k) erase_row(r, from + 1);
    const CheckedRecord checked = check_record(r, declared);
    EXPECT_EQ(find(checked.check, FindingKind::wrapped), nullptr) << begin << "\n" << messages(checked.check);
    EXPECT_EQ(checked.record.column(Channel::motor_position).back(), q.back());
  }
  EXPECT_GE(tried, 3);
}

TEST(RecordCheck, CutsAStretchInWhichAnEncoderStandsStill) {
  Record r = healthy();
  std::vector<double>& load = r.column(Channel::load_position);
  for (std::size_t k = 6000; k < 8000; ++k) load[k] = load[6000];
  const CheckedRecord checked = check_record(r, servo());
  const Finding* const frozen = find(checked.check, FindingKind::frozen);
  ASSERT_NE(frozen, nullptr);
  EXPECT_EQ(frozen->channel, "load_position");
  EXPECT_NEAR(frozen->from, 6000 * kInterval, 1e-9);
  EXPECT_NEAR(longest_stretch(checked.check).to, 6000 * kInterval, 1e-9);
}

// A load that rests while the motor crosses the gap is not frozen, whatever its encoder repeats.
TEST(RecordCheck, ALoadThatRestsInTheGapIsSound) {
  Record r;
  r.name = "run.csv";
  for (int k = 0; k < 10000; ++k) {
    const double t = k * kInterval, motor = 4e-4 * std::sin(2 * M_PI * 0.5 * t);
    r.time.push_back(t);
    r.column(Channel::motor_torque).push_back(std::sin(2 * M_PI * 0.5 * t + 0.3));
    r.column(Channel::motor_position).push_back(rounded(motor, kMotorStep));
    const double pushed = std::fabs(motor) > 0.5 * kGap ? motor - std::copysign(0.5 * kGap, motor) : 0;
    r.column(Channel::load_position).push_back(rounded(pushed, kStep));
  }
  EXPECT_EQ(messages(check_record(r).check), "");
}

TEST(RecordCheck, SaysHowOftenAHeldChannelIsRead) {
  Record r = healthy();
  std::vector<double>& load = r.column(Channel::load_position);
  for (std::size_t k = 0; k < load.size(); ++k) load[k] = load[k - k % 8];
  const CheckedRecord checked = check_record(r, servo());
  const Finding* const held = find(checked.check, FindingKind::held_samples);
  ASSERT_NE(held, nullptr) << messages(checked.check);
  EXPECT_EQ(held->channel, "load_position");
  EXPECT_NEAR(checked.check.channels[2].rate, 1 / (8 * kInterval),
              5);  // Hz; where it turns round some are equal by chance
}

// A motor that rests, swings out at once and comes back: the way that makes up for the rest is none.
TEST(RecordCheck, AMotorThatRestsAndSwingsIsNotHeld) {
  Record r;
  r.name = "run.csv";
  for (int k = 0; k < 10000; ++k) {
    const int since = k % 400 - 300;  // samples since the swing began
    r.time.push_back(k * kInterval);
    r.column(Channel::motor_torque).push_back(since > 0 ? std::cos(M_PI * since / 100) : 0.1);
    r.column(Channel::motor_position)
        .push_back(since > 0 ? rounded(std::sin(M_PI * since / 100), 1e-3) : 1e-3);
  }
  EXPECT_EQ(find(check_record(r).check, FindingKind::held_samples), nullptr);
}

// Only the rows in which the encoder was read are used: 0, 8, 16 of the record as it was before it was held.
TEST(RecordCheck, UsesTheRowsWithNewValues) {
  const Record before = healthy();
  for (const bool torque : {false, true}) {
    Record r = before;
    for (std::size_t k = 0; k < r.size(); ++k) {
      r.column(Channel::load_position)[k] = before.column(Channel::load_position)[k - k % 8];
      if (torque) r.column(Channel::motor_torque)[k] = before.column(Channel::motor_torque)[k - k % 8];
    }
    const CheckedRecord checked = check_record(r, servo());
    for (const Finding& finding : checked.check.findings)
      EXPECT_EQ(finding.consequence == Consequence::mended, finding.channel == "load_position");
    ASSERT_NEAR(double(checked.record.size()), double(before.size()) / 8, 3);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < checked.record.size(); ++i)
      wrong += std::size_t(std::lround(checked.record.time[i] / kInterval)) % 8 != 0;
    EXPECT_LE(wrong, 3u);  // choice: where the encoder happens to read alike twice
  }
}

// Of channels that are new in turn no row has both.
TEST(RecordCheck, KeepsHeldRowsWhereChannelsAreNewInTurn) {
  const Record before = healthy();
  Record r = before;
  for (std::size_t k = 4; k < r.size(); ++k) {
    r.column(Channel::load_position)[k] = before.column(Channel::load_position)[k - k % 8];
    r.column(Channel::motor_position)[k] = before.column(Channel::motor_position)[k - (k + 4) % 8];
  }
  const CheckedRecord checked = check_record(r, servo());
  EXPECT_EQ(find(checked.check, FindingKind::held_samples)->consequence, Consequence::noted);
  EXPECT_EQ(checked.record.size(), before.size());
}

TEST(RecordCheck, RefusesATorqueThatWasNotRecorded) {
  Record r = healthy();
  r.column(Channel::motor_torque).assign(r.size(), 0.0);
  const CheckedRecord checked = check_record(r, servo());
  const Finding* const refusal = checked.check.refusal();
  ASSERT_NE(refusal, nullptr);
  EXPECT_EQ(refusal->kind, FindingKind::dead);
  EXPECT_EQ(refusal->channel, "motor_torque");
}

TEST(RecordCheck, ALoadThatIsTheMotorOnceMoreIsAbsent) {
  Record r = healthy();
  r.column(Channel::load_position) = r.column(Channel::motor_position);
  const CheckedRecord checked = check_record(r, servo());
  EXPECT_NE(find(checked.check, FindingKind::dead), nullptr);
  EXPECT_FALSE(checked.record.has(Channel::load_position));
}

TEST(RecordCheck, RefusesTwoSourcesInTurn) {
  Record r = healthy();
  std::vector<double>& motor = r.column(Channel::motor_position);
  for (std::size_t k = 1; k < motor.size(); k += 2) motor[k] = 0;  // as a node that publishes zeros
  const Finding* const refusal = check_record(r, servo()).check.refusal();
  EXPECT_NE(find(check_record(r, servo()).check, FindingKind::two_publishers), nullptr);
  EXPECT_NE(refusal, nullptr);
}

TEST(RecordCheck, RefusesASpeedOfTheOtherSignOrInDegrees) {
  for (const double times : {-1.0, 180 / M_PI}) {
    Record r = healthy();
    for (const double t : r.time)
      r.column(Channel::motor_velocity).push_back(times * (position(t + 1e-4) - position(t - 1e-4)) / 2e-4);
    const CheckedRecord checked = check_record(r, servo());
    const Finding* const refusal = checked.check.refusal();
    ASSERT_NE(refusal, nullptr) << times;
    EXPECT_EQ(refusal->kind, times < 0 ? FindingKind::sign : FindingKind::scale);
    EXPECT_EQ(refusal->channel, "motor_velocity");
  }
}

TEST(RecordCheck, RefusesASpeedInPlaceOfAPosition) {
  Record r = healthy();
  for (const double t : r.time)
    r.column(Channel::load_velocity).push_back((position(t + 1e-4) - position(t - 1e-4)) / 2e-4);
  std::swap(r.column(Channel::load_velocity), r.column(Channel::motor_position));
  const CheckedRecord checked = check_record(r, servo());
  const Finding* const swapped = find(checked.check, FindingKind::swapped);
  ASSERT_NE(swapped, nullptr) << messages(checked.check);
  EXPECT_EQ(swapped->consequence, Consequence::refused);
}

TEST(RecordCheck, SaysThatThePositionsComeApart) {
  Record r = healthy();
  for (std::size_t k = 0; k < r.size(); ++k) r.column(Channel::load_position)[k] += 5e-4 * r.time[k];
  const CheckedRecord checked = check_record(r, servo());
  const Finding* const drift = find(checked.check, FindingKind::drift);
  ASSERT_NE(drift, nullptr);
  EXPECT_EQ(drift->consequence, Consequence::noted);
}

TEST(RecordCheck, CountsWhatIsNoNumber) {
  Record r = healthy();
  r.column(Channel::load_position)[500] = NAN;
  const CheckedRecord checked = check_record(r, servo());
  const Finding* const none = find(checked.check, FindingKind::not_finite);
  ASSERT_NE(none, nullptr);
  EXPECT_NEAR(none->from, 500 * kInterval, 1e-9);
  EXPECT_EQ(none->consequence, Consequence::mended);
  erase_row(r, 500);
  EXPECT_EQ(checked.record.time, r.time);
  EXPECT_EQ(checked.record.column(Channel::load_position), r.column(Channel::load_position));
}

TEST(RecordCheck, AChannelOfHardlyANumberIsAbsent) {
  Record r = healthy();
  r.column(Channel::load_velocity).assign(r.size(), NAN);
  r.column(Channel::load_velocity)[7] = 1;
  const CheckedRecord checked = check_record(r, servo());
  EXPECT_NE(find(checked.check, FindingKind::not_finite), nullptr);
  EXPECT_FALSE(checked.record.has(Channel::load_velocity));
  EXPECT_EQ(checked.record.size(), r.size());
}

}  // namespace
}  // namespace backlash::record
