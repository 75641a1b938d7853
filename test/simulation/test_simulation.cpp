// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/simulation/simulation.h"
#include "support/data.h"
#include "support/rigs.h"

namespace backlash::simulation {
namespace {

SimulationSettings shipped_settings() {
  return read_simulation_settings(YamlReader::from_file(test::package_file("config/sarkar_1997.yaml")));
}

SimulationSettings noisy_settings(std::uint64_t seed) {
  SimulationSettings settings = shipped_settings();
  settings.sensors.seed = seed;
  settings.sensors.of(record::Channel::sensor_torque).noise = 0.002;
  settings.sensors.of(record::Channel::motor_position).noise = 1e-6;
  return settings;
}

bool same(const record::Record& a, const record::Record& b) {
  if (a.time != b.time) return false;
  return std::all_of(record::kChannels.begin(), record::kChannels.end(),
                     [&](record::Channel c) { return a.column(c) == b.column(c); });
}

double standard_deviation(const std::vector<double>& values) {
  double sum = 0, squares = 0;
  for (double v : values) sum += v;
  const double mean = sum / values.size();
  for (double v : values) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / (values.size() - 1));
}

TEST(Simulation, SamplesAtWholeMultiplesOfTheInterval) {
  Simulation simulation(test::sarkar_rig(30e-6), shipped_settings());
  EXPECT_EQ(simulation.index(), 0);
  EXPECT_EQ(simulation.sampling_rate(), 1000);
  const model::Observation first = simulation.step();
  EXPECT_EQ(first.motor_position, 0);
  EXPECT_EQ(first.motor_velocity, 0);
  EXPECT_EQ(first.sensor_torque, 0);
  EXPECT_EQ(first.motor_torque, 0.05);
  Plant plant(test::sarkar_rig(30e-6), shipped_settings().excitation, shipped_settings().solver);
  for (int k = 1; k < 120; ++k) {
    EXPECT_EQ(simulation.index(), k);
    const model::Observation o = simulation.step();
    plant.advance_to(k / 1000.0);
    EXPECT_EQ(o.sensor_torque, plant.observe().sensor_torque);
    EXPECT_EQ(o.motor_torque, k / 50 % 2 == 0 ? 0.05 : -0.05) << k;
  }
}

TEST(Simulation, RecordHoldsEverySensorOfTheRig) {
  const record::Record record = simulate_record(test::sarkar_rig(30e-6), shipped_settings(), 0.25);
  EXPECT_EQ(record.name, "sarkar_1997");
  ASSERT_EQ(record.size(), 250u);
  for (std::size_t k = 0; k < record.size(); ++k) EXPECT_EQ(record.time[k], k / 1000.0);
  for (record::Channel channel :
       {record::Channel::motor_torque, record::Channel::motor_position, record::Channel::motor_velocity,
        record::Channel::sensor_torque, record::Channel::load_position, record::Channel::load_velocity})
    EXPECT_EQ(record.column(channel).size(), 250u) << record::channel_name(channel);
  EXPECT_FALSE(record.has(record::Channel::reference_position));
  model::Rig rigid = test::sarkar_rig(30e-6);
  rigid.input_coupling = model::Coupling{};
  EXPECT_FALSE(simulate_record(rigid, shipped_settings(), 0.05).has(record::Channel::sensor_torque));
}

TEST(Simulation, RecordsCurrentAndAccelerationOnlyWhereDeclared) {
  model::Rig rig = test::sarkar_rig(30e-6);
  rig.torque_constant = 0.02;
  const record::Record without = simulate_record(rig, shipped_settings(), 0.25);
  EXPECT_FALSE(without.has(record::Channel::motor_current));
  EXPECT_FALSE(without.has(record::Channel::acceleration));
  SimulationSettings settings = shipped_settings();
  settings.sensors.sampling_rate = 20000;  // fine enough to integrate the acceleration
  settings.sensors.of(record::Channel::motor_current).declared =
      settings.sensors.of(record::Channel::acceleration).declared = true;
  rig.link_locked = true;
  rig.output_coupling = model::Coupling{};  // the gear is fixed: the acceleration is the pinion's
  rig.input_coupling = model::Coupling{};   // and motor and pinion are one body
  const record::Record record = simulate_record(rig, settings, 0.25);
  ASSERT_EQ(record.column(record::Channel::motor_current).size(), record.size());
  ASSERT_EQ(record.column(record::Channel::acceleration).size(), record.size());
  for (std::size_t k = 0; k < record.size(); ++k)
    EXPECT_DOUBLE_EQ(record.column(record::Channel::motor_current)[k],
                     record.column(record::Channel::motor_torque)[k] / 0.02);
  // Its integral is the speed, here in the free flight to the first contact: 30 um at 0.05 N m on 4.34e-5 kg
  // m^2 take 1.9 ms. With drag 0.0048 N m s/rad the trapezoidal rule errs by (h c / J)^2 / 12 = 2.5e-6; twice
  // that allowed.
  const auto& a = record.column(record::Channel::acceleration);
  const auto& w = record.column(record::Channel::motor_velocity);
  double speed = 0;
  for (int k = 1; k < 30; ++k) {
    speed += 0.5 * (a[k] + a[k - 1]) / 20000;
    EXPECT_NEAR(speed, w[k], 5e-6 * std::fabs(w[k])) << k;
  }
}

TEST(Simulation, IsDeterministicForASeed) {
  const model::Rig rig = test::sarkar_rig(30e-6);
  const record::Record one = simulate_record(rig, noisy_settings(1), 0.2);
  EXPECT_TRUE(same(one, simulate_record(rig, noisy_settings(1), 0.2)));
  const record::Record other = simulate_record(rig, noisy_settings(2), 0.2);
  EXPECT_FALSE(same(one, other));
  EXPECT_EQ(one.column(record::Channel::motor_velocity),
            other.column(record::Channel::motor_velocity));  // has no noise
}

TEST(Simulation, ResetBeginsAgainWithTheRigsBacklashAndTheSameNoise) {
  Simulation simulation(test::sarkar_rig(30e-6), noisy_settings(3));
  std::vector<double> before, after;
  for (int k = 0; k < 77; ++k) before.push_back(simulation.step().sensor_torque);
  simulation.plant().set_backlash(150e-6);
  for (int k = 0; k < 20; ++k) simulation.step();
  simulation.reset();
  EXPECT_EQ(simulation.index(), 0);
  EXPECT_EQ(simulation.plant().gear_train().backlash(), 60e-6);
  for (int k = 0; k < 77; ++k) after.push_back(simulation.step().sensor_torque);
  EXPECT_EQ(before, after);
}

TEST(Simulation, TwoSimulationsWithDifferentGapsDoNotInfluenceEachOther) {
  const SimulationSettings settings = noisy_settings(4);
  Simulation a(test::sarkar_rig(10e-6), settings), b(test::sarkar_rig(55e-6), settings);
  const record::Record alone_a = simulate_record(test::sarkar_rig(10e-6), settings, 0.15);
  const record::Record alone_b = simulate_record(test::sarkar_rig(55e-6), settings, 0.15);
  for (std::size_t k = 0; k < 150; ++k) {
    EXPECT_EQ(a.step().sensor_torque, alone_a.column(record::Channel::sensor_torque)[k]);
    EXPECT_EQ(b.step().sensor_torque, alone_b.column(record::Channel::sensor_torque)[k]);
  }
  EXPECT_FALSE(same(alone_a, alone_b));
}

TEST(Simulation, BacklashInjectedWhileRunningShowsInTheTravel) {
  Simulation simulation(test::sarkar_rig(10e-6), shipped_settings());
  const auto travel_of_next_period = [&] {
    double low = 1, high = -1;
    for (int k = 0; k < 100; ++k) {
      const double q = simulation.step().motor_position;
      low = std::min(low, q);
      high = std::max(high, q);
    }
    return high - low;
  };
  for (int k = 0; k < 300; ++k) simulation.step();
  const double before = travel_of_next_period();
  simulation.plant().set_backlash(2 * 40e-6);
  travel_of_next_period();
  // 30 um more half gap are 60 um / r of travel and more overshoot behind it
  EXPECT_GT(travel_of_next_period() - before, 0.9 * 60e-6 / 0.014917);
}

TEST(Simulation, ProgressRisesAndMayCancel) {
  std::vector<double> seen;
  const model::Rig rig = test::sarkar_rig(30e-6);
  simulate_record(rig, shipped_settings(), 3, [&](double fraction, const std::string& phase) {
    seen.push_back(fraction);
    EXPECT_EQ(phase, "simulating");
    return true;
  });
  EXPECT_GE(seen.size(), 3u);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(seen.front(), 0);
  EXPECT_EQ(seen.back(), 1);
  EXPECT_THROW(
      simulate_record(rig, shipped_settings(), 3, [](double f, const std::string&) { return f < 0.3; }),
      Cancelled);
}

TEST(Simulation, RefusesDurationsWithoutSense) {
  const model::Rig rig = test::sarkar_rig(30e-6);
  for (double duration :
       {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity(), 1e-4, 1e12, 1e300})
    EXPECT_THROW(simulate_record(rig, shipped_settings(), duration), InvalidParameter) << duration;
  EXPECT_EQ(simulate_record(rig, shipped_settings(), 6e-4).size(), 1u);
}

TEST(SimulationSettings, ShippedFileIsReadAndASolverMayBeLeftOut) {
  const SimulationSettings settings = shipped_settings();
  EXPECT_EQ(settings.excitation.type, "square");
  EXPECT_EQ(settings.excitation.amplitude, 0.05);
  EXPECT_EQ(settings.excitation.frequency, 10);
  EXPECT_EQ(settings.sensors.sampling_rate, 1000);
  EXPECT_EQ(settings.solver.method, "dormand_prince");
  const YamlReader yaml =
      YamlReader::from_text("excitation: {type: topic}\nsensors: {sampling_rate: 10, seed: 0}\n", "t");
  EXPECT_EQ(read_simulation_settings(yaml).solver.relative_tolerance, 1e-6);
  EXPECT_NO_THROW(yaml.finish());
}

/// A diagnosis needs neither; what simulates asks for both.
TEST(SimulationSettings, WithoutExcitationOrSensorsNothingIsSimulated) {
  for (const char* text : {"sensors: {sampling_rate: 10, seed: 0}", "excitation: {type: topic}"}) {
    const SimulationSettings settings = read_simulation_settings(YamlReader::from_text(text, "t"));
    EXPECT_THROW(Simulation(test::sarkar_rig(30e-6), settings), InvalidParameter) << text;
  }
}

// Records of the same rig by a separate program: sensor noise 0.002 N m, position noise 1e-6 rad.
class ReferenceRecord : public testing::TestWithParam<int> {};

TEST_P(ReferenceRecord, IsReproducedFromRestToWithinItsNoise) {
  const auto path = test::find_data("rig/rig_halfgap_" + std::to_string(GetParam()) + "um.csv");
  if (!path) GTEST_SKIP() << "no reference record for a half gap of " << GetParam() << " um";
  const record::Record reference = record::read_csv(*path);
  const record::Record simulated =
      simulate_record(test::sarkar_rig(GetParam() * 1e-6), shipped_settings(), 1);
  const std::size_t n = simulated.size();
  ASSERT_EQ(n, 1000u);
  ASSERT_GE(reference.size(), n);
  std::vector<double> torque, position;
  for (std::size_t k = 0; k < n; ++k) {
    ASSERT_NEAR(reference.time[k], simulated.time[k], 1e-9);
    EXPECT_EQ(reference.column(record::Channel::motor_torque)[k],
              simulated.column(record::Channel::motor_torque)[k])
        << k;
    torque.push_back(reference.column(record::Channel::sensor_torque)[k] -
                     simulated.column(record::Channel::sensor_torque)[k]);
    position.push_back(reference.column(record::Channel::motor_position)[k] -
                       simulated.column(record::Channel::motor_position)[k]);
    // 5 standard deviations of either noise
    EXPECT_NEAR(torque.back(), 0, 0.010) << "at " << simulated.time[k];
    EXPECT_NEAR(position.back(), 0, 5e-6) << "at " << simulated.time[k];
  }
  // the standard deviation of n normal values scatters by 1 / sqrt(2 n) of itself: 2.2 %; 4 of those
  EXPECT_NEAR(standard_deviation(torque), 0.002, 0.002 * 4 / std::sqrt(2.0 * n));
  // 1e-6 of noise and what the other program's own tolerance leaves: with ours refined to 1e-11 it stays
  // at 1.15e-6
  EXPECT_LT(standard_deviation(position), 1.3e-6);
}

INSTANTIATE_TEST_SUITE_P(HalfGapMicrometres, ReferenceRecord, testing::Values(0, 30, 55));

}  // namespace
}  // namespace backlash::simulation
