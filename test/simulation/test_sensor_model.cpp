// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/simulation/sensor_model.h"

namespace backlash::simulation {
namespace {

constexpr int kCount = 100000;
// 5 standard deviations: one honest generator in 1.7 million fails, and the seeds here are fixed
constexpr double kSigmas = 5;

SensorsSettings with(record::Channel channel, const SensorSettings& sensor, std::uint64_t seed = 1) {
  SensorsSettings settings;
  settings.seed = seed;
  settings.of(channel) = sensor;
  return settings;
}

std::vector<double> draw(SensorModel& model, record::Channel channel, int count = kCount, double exact = 0) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(model.measure(channel, exact));
  return values;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (double v : values) sum += v;
  return sum / values.size();
}

/// Mean of a_i b_(i+lag) after subtraction of both means, per product of the standard deviations.
double correlation(const std::vector<double>& a, const std::vector<double>& b, std::size_t lag) {
  const double ma = mean(a), mb = mean(b);
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i + lag < a.size(); ++i) {
    ab += (a[i] - ma) * (b[i + lag] - mb);
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i + lag] - mb) * (b[i + lag] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

TEST(SensorModel, WithoutSettingsMeasuresExactly) {
  SensorModel model{SensorsSettings{}};
  for (record::Channel channel : record::kChannels)
    for (double value : {0.0, -1.25e-9, 3e7}) EXPECT_EQ(model.measure(channel, value), value);
}

TEST(SensorModel, NoiseHasTheStatedMeanAndStandardDeviationOnEveryChannel) {
  const double sigma = 0.002;
  for (std::uint64_t seed : {1, 2, 77})
    for (record::Channel channel : record::kChannels) {
      SensorModel model(with(channel, {sigma, 0, 0}, seed));
      const std::vector<double> noise = draw(model, channel, kCount, 0.7);
      const double m = mean(noise);
      EXPECT_NEAR(m, 0.7, kSigmas * sigma / std::sqrt(kCount)) << record::channel_name(channel);
      double chi_square = 0;  // with n - 1 degrees of freedom: mean n - 1, variance 2 (n - 1)
      for (double v : noise) chi_square += (v - m) * (v - m) / (sigma * sigma);
      EXPECT_NEAR(chi_square, kCount - 1, kSigmas * std::sqrt(2.0 * (kCount - 1)))
          << record::channel_name(channel);
    }
}

TEST(SensorModel, NoiseIsGaussian) {
  SensorModel model(with(record::Channel::sensor_torque, {1, 0, 0}));
  const std::vector<double> noise = draw(model, record::Channel::sensor_torque);
  for (double limit : {0.5, 1.0, 2.0, 3.0}) {
    const double p = std::erf(limit / std::sqrt(2));
    int inside = 0;
    for (double v : noise) inside += std::fabs(v) < limit;
    EXPECT_NEAR(inside, p * kCount, kSigmas * std::sqrt(p * (1 - p) * kCount)) << limit;  // binomial
  }
}

TEST(SensorModel, NoiseIsWhiteAndIndependentBetweenChannels) {
  SensorsSettings settings;
  for (record::Channel channel : record::kChannels) settings.of(channel).noise = 1;
  SensorModel model(settings);
  std::vector<std::vector<double>> noise;
  for (record::Channel channel : record::kChannels) noise.push_back(draw(model, channel));
  const double bound = kSigmas / std::sqrt(kCount);
  for (std::size_t i = 0; i < record::kChannelCount; ++i) {
    for (std::size_t lag : {1, 2, 100}) EXPECT_NEAR(correlation(noise[i], noise[i], lag), 0, bound);
    for (std::size_t j = 0; j < i; ++j)
      for (std::size_t lag : {0, 1})
        EXPECT_NEAR(correlation(noise[i], noise[j], lag), 0, bound) << i << ", " << j;
  }
}

TEST(SensorModel, ASensorAddedLeavesTheNoiseOfTheOthersUnchanged) {
  SensorsSettings one = with(record::Channel::sensor_torque, {0.002, 0, 0}, 5);
  SensorsSettings two = one;
  two.of(record::Channel::motor_position) = {1e-6, 1e-7, 0.1};
  two.of(record::Channel::motor_torque).noise = 3;
  SensorModel a(one), b(two);
  model::Observation exact{};
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(a.measure(exact).sensor_torque, b.measure(exact).sensor_torque);
}

TEST(SensorModel, IsDeterministicForASeedAndAcrossReset) {
  const SensorsSettings settings = with(record::Channel::load_position, {1, 0, 0}, 42);
  SensorModel a(settings), b(settings);
  const std::vector<double> first = draw(a, record::Channel::load_position, 1001);
  EXPECT_EQ(first, draw(b, record::Channel::load_position, 1001));
  a.reset();  // after an odd number: half a pair of normal numbers is left over
  EXPECT_EQ(first, draw(a, record::Channel::load_position, 1001));
  EXPECT_NE(first, draw(b, record::Channel::load_position, 1001));
}

TEST(SensorModel, NoiseSetWhileItRunsIsThatOfTheSeed) {
  const record::Channel channel = record::Channel::motor_position;
  SensorModel quiet{SensorsSettings()}, noisy(with(channel, SensorSettings{0.25}));
  EXPECT_EQ(quiet.measure(channel, 1), 1);
  quiet.set_noise(channel, 0.25);
  EXPECT_EQ(draw(quiet, channel, 100), draw(noisy, channel, 100));
  for (const double wrong : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(quiet.set_noise(channel, wrong), InvalidParameter);
  EXPECT_EQ(draw(quiet, channel, 100), draw(noisy, channel, 100));  // what was refused changed nothing
  quiet.set_noise(channel, 0);
  EXPECT_EQ(quiet.measure(channel, 1), 1);
}

TEST(SensorModel, EverySeedGivesOtherNoise) {
  std::vector<double> first;
  for (std::uint64_t seed : {0ULL, 1ULL, 2ULL, 1ULL << 32, (1ULL << 32) + 1, 1ULL << 53}) {
    SensorModel model(with(record::Channel::motor_velocity, {1, 0, 0}, seed));
    const double value = model.measure(record::Channel::motor_velocity, 0);
    for (double other : first) EXPECT_NE(value, other) << seed;
    first.push_back(value);
  }
}

TEST(SensorModel, QuantisesToTheNearestStep) {
  SensorModel model(with(record::Channel::motor_position, {0, 0.25, 0}));
  EXPECT_EQ(model.measure(record::Channel::motor_position, 0.124), 0);
  EXPECT_EQ(model.measure(record::Channel::motor_position, 0.126), 0.25);
  EXPECT_EQ(model.measure(record::Channel::motor_position, -0.126), -0.25);
  EXPECT_EQ(model.measure(record::Channel::motor_position, 100.1), 100);
  SensorModel encoder(with(record::Channel::motor_position, {0, 8.7e-7, 0}));
  for (double exact = -0.01; exact < 0.01; exact += 1.234e-5) {
    const double measured = encoder.measure(record::Channel::motor_position, exact);
    EXPECT_LE(std::fabs(measured - exact), 0.5 * 8.7e-7 * (1 + 1e-9));
    EXPECT_NEAR(measured / 8.7e-7, std::round(measured / 8.7e-7), 1e-9);
  }
}

TEST(SensorModel, AddsItsOffset) {
  SensorModel model(with(record::Channel::motor_torque, {0, 0, -0.3}));
  EXPECT_DOUBLE_EQ(model.measure(record::Channel::motor_torque, 1), 0.7);
}

TEST(SensorModel, SaturatesAtBothLimits) {
  SensorModel model(with(record::Channel::sensor_torque, {0, 0, 0, 0.15}));
  EXPECT_EQ(model.measure(record::Channel::sensor_torque, 0.1), 0.1);
  EXPECT_EQ(model.measure(record::Channel::sensor_torque, 7), 0.15);
  EXPECT_EQ(model.measure(record::Channel::sensor_torque, -7), -0.15);
}

TEST(SensorModel, OffsetAndNoiseComeBeforeSaturationAndThatBeforeQuantisation) {
  SensorModel offset(with(record::Channel::sensor_torque, {0, 0, 0.1, 0.15}));
  EXPECT_EQ(offset.measure(record::Channel::sensor_torque, 0.1), 0.15);
  SensorModel noisy(with(record::Channel::sensor_torque, {1, 0, 0, 0.5}));
  for (double v : draw(noisy, record::Channel::sensor_torque, 1000)) EXPECT_LE(std::fabs(v), 0.5);
  SensorModel quantised(with(record::Channel::sensor_torque, {0, 0.1, 0, 0.26}));
  EXPECT_DOUBLE_EQ(quantised.measure(record::Channel::sensor_torque, 1),
                   0.3);  // 0.26 rounded to steps of 0.1
}

TEST(SensorModel, AMissingSensorStaysMissingAndDisturbsNobody) {
  SensorsSettings settings;
  for (record::Channel channel : record::kChannels) settings.of(channel) = {0.1, 0.01, 1, 5, false};
  SensorModel a(settings), b(settings);
  model::Observation there{}, missing{};
  missing.sensor_torque = std::nan("");
  for (int i = 0; i < 20; ++i) {
    const model::Observation x = a.measure(there), y = b.measure(missing);
    EXPECT_TRUE(std::isnan(y.sensor_torque));
    EXPECT_EQ(x.motor_position, y.motor_position);
    EXPECT_EQ(x.load_velocity, y.load_velocity);
  }
}

TEST(SensorModel, EachValueOfAnObservationHasItsOwnSensor) {
  SensorsSettings settings;
  for (std::size_t i = 0; i < record::kChannelCount; ++i) settings.channels[i].offset = 10.0 * (1 << i);
  SensorModel model(settings);
  const auto offset = [&](record::Channel channel) { return settings.of(channel).offset; };
  model::Observation exact{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  const model::Observation measured = model.measure(exact);
  EXPECT_EQ(measured.motor_torque, 1 + offset(record::Channel::motor_torque));
  EXPECT_EQ(measured.motor_position, 2 + offset(record::Channel::motor_position));
  EXPECT_EQ(measured.motor_velocity, 3 + offset(record::Channel::motor_velocity));
  EXPECT_EQ(measured.sensor_torque, 4 + offset(record::Channel::sensor_torque));
  EXPECT_EQ(measured.load_position, 7 + offset(record::Channel::load_position));
  EXPECT_EQ(measured.load_velocity, 8 + offset(record::Channel::load_velocity));
  EXPECT_EQ(measured.sensor_twist, 5);  // no sensor of their own
  EXPECT_EQ(measured.sensor_twist_rate, 6);
}

TEST(SensorModel, CurrentAndAccelerationAreMeasuredWhereTheRigDeclaresThem) {
  model::Observation exact{};
  exact.motor_current = 2;
  exact.acceleration = 300;
  exact.output_torque = 4;
  const SensorsSettings none = read_sensors(YamlReader::from_text("{sampling_rate: 1, seed: 1}", "rig.yaml"));
  EXPECT_TRUE(std::isnan(SensorModel(none).measure(exact).motor_current));
  EXPECT_TRUE(std::isnan(SensorModel(none).measure(exact).acceleration));
  EXPECT_EQ(SensorModel(none).measure(exact).output_torque, 4);
  const SensorsSettings both = read_sensors(YamlReader::from_text(
      "{sampling_rate: 1, seed: 1, motor_current: {offset: 0.5}, acceleration: {resolution: 7}, "
      "output_torque: {reversed: true, offset: 1}}",
      "rig.yaml"));
  EXPECT_EQ(SensorModel(both).measure(exact).motor_current, 2.5);
  EXPECT_EQ(SensorModel(both).measure(exact).acceleration, 301);
  EXPECT_EQ(SensorModel(both).measure(exact).output_torque, -3);
}

SensorsSettings read(const std::string& text) {
  const YamlReader yaml = YamlReader::from_text(text, "rig.yaml");
  const SensorsSettings settings = read_sensors(yaml);
  yaml.finish();
  return settings;
}

TEST(SensorsSettings, ReadsEveryValue) {
  const SensorsSettings settings = read(
      "sampling_rate: 2000\nseed: 9007199254740992\n"
      "sensor_torque: {noise: 0.002, resolution: 1e-4, offset: -0.01, limit: 0.5}\nmotor_position: {}\n");
  EXPECT_EQ(settings.sampling_rate, 2000);
  EXPECT_EQ(settings.seed, std::uint64_t{1} << 53);
  const SensorSettings& torque = settings.of(record::Channel::sensor_torque);
  EXPECT_EQ(torque.noise, 0.002);
  EXPECT_EQ(torque.resolution, 1e-4);
  EXPECT_EQ(torque.offset, -0.01);
  EXPECT_EQ(torque.limit, 0.5);
  EXPECT_EQ(settings.of(record::Channel::motor_position).noise, 0);
  EXPECT_EQ(settings.of(record::Channel::load_position).limit, std::numeric_limits<double>::infinity());
}

TEST(SensorsSettings, NoiseNeedsASeed) {
  EXPECT_NO_THROW(SensorModel(read("sampling_rate: 1000\nsensor_torque: {offset: 0.01}\n")));
  EXPECT_THROW(SensorModel(read("sampling_rate: 1000\nsensor_torque: {noise: 0.01}\n")), InvalidParameter);
}

TEST(SensorsSettings, RefusalNamesFileLineKeyValueAndLimit) {
  const struct {
    const char* text;
    const char* message;
  } cases[] = {
      {"seed: 1\n", "rig.yaml:1: sampling_rate: is missing, expected a number"},
      {"sampling_rate: 0\nseed: 1\n", "rig.yaml:1: sampling_rate = 0: must be > 0"},
      {"sampling_rate: 1 kHz\nseed: 1\n", "rig.yaml:1: sampling_rate = 1 kHz: not a number"},
      {"sampling_rate: 1000\nseed: -1\n", "rig.yaml:2: seed = -1: must be >= 0"},
      {"sampling_rate: 1000\nseed: 1.5\n", "rig.yaml:2: seed = 1.5: must be an integer"},
      {"sampling_rate: 1\nseed: 1\nsensor_torque: 0.002\n",
       "rig.yaml:3: sensor_torque = 0.002: must be a map"},
      {"sampling_rate: 1\nseed: 1\nsensor_torque: {noise: -1}\n",
       "rig.yaml:3: sensor_torque.noise = -1: must be >= 0"},
      {"sampling_rate: 1\nseed: 1\nsensor_torque: {resolution: -1}\n",
       "rig.yaml:3: sensor_torque.resolution = -1: must be >= 0"},
      {"sampling_rate: 1\nseed: 1\nsensor_torque: {limit: 0}\n",
       "rig.yaml:3: sensor_torque.limit = 0: must be > 0"},
      {"sampling_rate: 1\nseed: 1\nsensor_torque: {offset: .nan}\n",
       "rig.yaml:3: sensor_torque.offset = .nan: not a"},
      {"sampling_rate: 1\nseed: 1\nsensor_torque: {gain: 2}\n",
       "rig.yaml:3: sensor_torque.gain = 2: unknown key"},
      {"sampling_rate: 1\nseed: 1\ntorque: {noise: 2}\n", "rig.yaml:3: torque = {...}: unknown key"},
  };
  for (const auto& bad : cases) {
    try {
      read(bad.text);
      ADD_FAILURE() << "accepted: " << bad.text;
    } catch (const BadData& error) {
      EXPECT_EQ(std::string(error.what()).substr(0, std::string(bad.message).size()), bad.message);
    }
  }
}

}  // namespace
}  // namespace backlash::simulation
