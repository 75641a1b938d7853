// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/model_comparison.h"
#include "backlash_diagnosis/identification/procedures/gap_terms.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "support/data.h"

namespace backlash::identification {
namespace {

constexpr double kGap = 5.358e-4;  // rad, of both rigs with a gap

rig_file::RigFile rig_file(const std::string& name) {
  return rig_file::load_rig_file(test::package_file("config/" + name + ".yaml"));
}

record::Record run(rig_file::RigFile file, const std::string& name, double duration) {
  rig_file::apply_test_run(rig_file::find_test_run(file.test_runs, name), file);
  return simulation::simulate_record(file.rig, file.simulation, duration);
}

/// rms over the record of half of what the gap of config/yumrukcal_2013_varying.yaml differs from its mean.
double rms_of_half_variation(const record::Record& record) {
  double sum = 0;
  for (const double q : record.column(record::Channel::load_position))
    sum += std::pow(0.5 * kGap * (0.10 * std::sin(q + 0.6) + 0.05 * std::sin(3 * q)), 2);
  return std::sqrt(sum / double(record.size()));
}

TEST(ModelComparison, EngagementsFollowTheSwitchesOfTheTorque) {
  const rig_file::RigFile file = rig_file("yumrukcal_2013");
  const ComparedRecord r = compared_record(run(file, "square_wave_backward", 6.2), file.rig);
  ASSERT_EQ(r.engagements.size(), 9u);  // 0.8 Hz: a switch every 0.625 s
  for (std::size_t i = 0; i < r.engagements.size(); ++i) {
    const Engagement& e = r.engagements[i];
    const double late = e.time - 0.625 * double(i + 1);
    EXPECT_GT(late, 0) << i;
    // The motor (6.3 kg m^2, more than 110 N m, the friction with it) is through half the gap in less than
    // this:
    EXPECT_LT(late, 0.002 + std::sqrt(2 * kGap * 6.3 / 110)) << i;
    EXPECT_EQ(e.direction, i % 2 ? 1 : -1) << i;
  }
}

TEST(ModelComparison, KnownTorqueErrorIsReported) {
  const rig_file::RigFile file = rig_file("yumrukcal_2013");
  record::Record record = run(file, "square_wave", 10);
  const auto clean = compare_models({file.rig}, compared_record(record, file.rig)).front();
  auto& torque = record.column(record::Channel::motor_torque);
  for (std::size_t k = 0; k < torque.size(); ++k) torque[k] += 4 * std::sin(2 * M_PI * 7 * record.time[k]);
  const auto c = compare_models({file.rig}, compared_record(record, file.rig)).front();
  // 4 / sqrt 2 and what the clean record leaves; 70 cycles, of which standstills cut parts off.
  EXPECT_NEAR(c.followed.at("torque").rms, std::hypot(4 / std::sqrt(2), clean.followed.at("torque").rms),
              0.06);
  // The deflection does not hear of the torque as long as the motor is followed.
  EXPECT_NEAR(c.followed.at("deflection").rms, clean.followed.at("deflection").rms, 1e-8);
}

/// A record that begins while the load is thrown to and fro: where the load starts is not known well, and
/// what that leaves is no error of the model. Counted, it would be 25 times the noise here.
TEST(ModelComparison, StartOfTheLoadDoesNotCount) {
  const rig_file::RigFile file = rig_file("yumrukcal_2013");
  const record::Record record = run(file, "square_wave", 10).slice(5.01, 10);  // 10 ms after a switch
  const auto c = compare_models({file.rig}, compared_record(record, file.rig)).front();
  EXPECT_NEAR(c.followed.at("deflection").error / c.followed.at("deflection").floor, 1, 0.2);
}

TEST(ModelComparison, LadderOfTheThesis) {
  const rig_file::RigFile varying = rig_file("yumrukcal_2013_varying");
  const model::Rig basic = rig_file("yumrukcal_2013_basic").rig, constant = rig_file("yumrukcal_2013").rig;
  const record::Record record = run(varying, "square_wave_backward", 60);
  const ComparedRecord r = compared_record(record, varying.rig);
  const auto models = compare_models({basic, constant, varying.rig}, r);
  const auto error = [&](int model, const char* channel) { return models[model].followed.at(channel).error; };
  const auto free = [&](int model, const char* channel) { return models[model].free.at(channel).error; };
  for (const char* channel : {"deflection", "torque", "speed_difference"}) {
    EXPECT_GT(error(0, channel), 3 * error(1, channel)) << channel;
    EXPECT_GT(error(1, channel), 1.4 * error(2, channel)) << channel;
  }
  for (const char* channel : {"deflection", "motor_speed", "speed_difference"}) {
    EXPECT_GT(free(0, channel), 3 * free(1, channel)) << channel;
    EXPECT_GT(free(1, channel), 3 * free(2, channel)) << channel;
    // Beyond the noise: what the noise of the start and of the torque grows to within 0.17 s.
    EXPECT_LT(free(2, channel), 1.4 * models[2].free.at(channel).floor) << channel;
  }
  EXPECT_LT(error(2, "deflection"), 0.1 * error(0, "deflection"));
  // The true model leaves noise alone; how much that is is estimated to some 10 %.
  EXPECT_NEAR(error(2, "deflection") / models[2].followed.at("deflection").floor, 1, 0.2);
  // Without a gap the deflection lacks half of it, one way or the other; some 1 % of the time is between.
  EXPECT_NEAR(models[0].followed.at("deflection").rms / (0.5 * kGap), 1, 0.04);
  // With the mean gap it lacks half of the variation, by the place of the load.
  EXPECT_NEAR(models[1].followed.at("deflection").rms / rms_of_half_variation(record), 1, 0.05);
  // Section 6.1: without a gap the first peak is too small, the ringing right; 6.2: with one the peak is
  // right.
  EXPECT_LT(models[0].peak_ratio, 0.8);
  EXPECT_NEAR(models[1].peak_ratio, 1, 0.02);
  EXPECT_NEAR(models[2].peak_ratio, 1, 0.005);
  for (const ModelComparison& m : models) {
    EXPECT_NEAR(m.frequency_ratio, 1, 0.01);
    EXPECT_NEAR(m.damping_ratio, 1, 0.02);
  }
}

/// Section 6.3: the map of the constant-speed runs, used directly, makes the gap too large by its wind-up.
TEST(ModelComparison, MapUsedDirectlyIsTooLargeByTheWindUp) {
  const rig_file::RigFile varying = rig_file("yumrukcal_2013_varying");
  const model::Rig constant = rig_file("yumrukcal_2013").rig;
  GapMapSettings load;
  load.stiffness = {460e3, 0};
  load.friction_forward = {16.8 + 7.6 * 0.1745, 0};  // N m, at 10 deg/s [5.2]
  load.friction_reverse = {13.3 + 11.5 * 0.1745, 0};
  const GapMap map = identify_gap_map(run(varying, "constant_speed_forward", 40).slice(3, 40),
                                      run(varying, "constant_speed_backward", 40).slice(3, 40), load);
  const record::Record record = run(varying, "square_wave_backward", 20);
  const auto models =
      compare_models({with_gap_map(constant, map), with_gap_map(constant, map, GapUse::directly)},
                     compared_record(record, varying.rig));
  const ChannelComparison& corrected = models[0].followed.at("deflection");
  const ChannelComparison& directly = models[1].followed.at("deflection");
  EXPECT_LT(corrected.error, 1.5 * corrected.floor);
  // Half of (16.8 + 13.3 + (7.6 + 11.5) 0.1745) N m / 460e3 N m/rad is missing on either side.
  EXPECT_NEAR(directly.rms / (0.5 * 33.43 / 460e3), 1, 0.05);
  EXPECT_GT(directly.error, 20 * corrected.error);
}

TEST(ModelComparison, RefusesARecordWithoutLoad) {
  const rig_file::RigFile file = rig_file("yumrukcal_2013");
  record::Record record = run(file, "square_wave", 1);
  record.column(record::Channel::load_position).clear();
  EXPECT_THROW(compared_record(record, file.rig), CannotIdentify);
}

}  // namespace
}  // namespace backlash::identification
