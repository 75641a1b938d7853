// SPDX-License-Identifier: BSD-3-Clause
// Public records of machines that nobody simulated, as they were published, by the rig files of the package.
// What is known of them: weights, lengths, and what is read by hand (doc/measured).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "backlash_diagnosis/identification/identify.h"
#include "backlash_diagnosis/record/record_check.h"
#include "backlash_diagnosis/record/table_file.h"
#include "backlash_diagnosis/rig_file/declared_motion.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "support/data.h"

namespace backlash::identification {
namespace {

class MeasuredMachines : public testing::Test {
 protected:
  void machine(const std::string& name) {
    file_ = rig_file::load_rig_file(test::package_file("config/" + name + ".yaml"));
  }
  bool read(const std::string& name) {
    const auto path = test::find_data("raw/" + name);
    if (!path) return false;
    record_ = record::read_table(*path, file_.channels);
    return true;
  }
  Identification identified() const { return identify(file_.rig, {record_}); }

  rig_file::RigFile file_;
  record::Record record_;
};

void contains(const Identification& found, const std::string& name, double truth) {
  const signal::Measured& m = found.parameters.at(name);
  EXPECT_NEAR(m.value, truth, 2 * m.standard_error) << name;
}

TEST_F(MeasuredMachines, APendulumOnAnAk80) {
  machine("ak80_pendulum");
  if (!read("ak80/pd_system_identification_measured.csv")) GTEST_SKIP() << "no raw records in ../shared/data";
  const Identification found = identified();
  contains(found, "gravity_amplitude", 2.985);  // 0.676 kg at 0.45 m
  contains(found, "inertia", 0.147);
  EXPECT_LT(found.parameters.at("inertia").standard_error, 0.3 * 0.147) << "and it shows it";
}

TEST_F(MeasuredMachines, AModelsTorqueIsNamed) {
  machine("ak80_pendulum");
  if (!read("ak80/gravity_compensation_measured_1kHz.csv"))
    GTEST_SKIP() << "no raw records in ../shared/data";
  const record::RecordCheck check = record::check_record(record_, rig_file::declared_motion(file_.rig)).check;
  const bool named = std::any_of(check.findings.begin(), check.findings.end(), [](const record::Finding& f) {
    return f.kind == record::FindingKind::dead && f.channel == "motor_torque" &&
           f.consequence == record::Consequence::refused;
  });
  EXPECT_TRUE(named);
}

TEST_F(MeasuredMachines, WeightsOnAGo1SayWhatAUnitIs) {
  machine("go1");
  signal::Measured weight[2];
  const char* const files[] = {"go1/2025-05-13_05h05m48.json", "go1/2025-05-13_05h07m50.json"};  // 1 and 2 kg
  for (int i = 0; i < 2; ++i) {
    if (!read(files[i])) GTEST_SKIP() << "no raw records in ../shared/data";
    weight[i] = identified().parameters.at("gravity_amplitude");
  }
  const double per_kilogram = weight[1].value - weight[0].value;
  const double error = std::hypot(weight[0].standard_error, weight[1].standard_error);
  const double truth = 9.81 * 0.15 / 6.10;  // units per kg
  EXPECT_NEAR(per_kilogram, truth, 0.03 * truth);
  EXPECT_NEAR(per_kilogram, truth, 2 * error);
}

TEST_F(MeasuredMachines, TwoPrintedGearsShowTheirPlayAtRest) {
  machine("embir");
  const std::pair<const char*, double> read_by_hand[] = {{"11-21-40", 0.0197}, {"11-31-10", 0.0209}};
  for (const auto& [name, apart] : read_by_hand) {
    if (!read(std::string("embir/dynamometer_test_15_07_2021_") + name + ".csv"))
      GTEST_SKIP() << "no raw records in ../shared/data";
    const diagnosis::Estimate e =
        diagnosis::estimate_position_difference(record_, *file_.diagnosis.position_difference);
    ASSERT_EQ(e.status, diagnosis::Status::ok) << e.message;
    EXPECT_LT(e.angle_lower, apart) << name;
    EXPECT_GT(e.angle_upper, apart) << name;
    EXPECT_NEAR(e.backlash_angle, apart, 3e-4) << "the last digit that is read by hand";
    EXPECT_LT(e.components->gap, apart);
  }
}

TEST_F(MeasuredMachines, FilesWithoutNamesOrWithNamesInTwoRowsAreRead) {
  machine("kinova_joint7");
  if (!read("kinova/velocity_0.300000readings.csv")) GTEST_SKIP() << "no raw records in ../shared/data";
  EXPECT_EQ(record_.size(), 2989u);
  EXPECT_DOUBLE_EQ(record_.column(record::Channel::motor_position).back(), 1.93184);
  machine("mitsubishi_servo");
  ASSERT_TRUE(read("mitsubishi/a3MR.csv"));
  EXPECT_EQ(record_.size(), 1024u);
  EXPECT_NEAR(record_.time[1], 0.000666666, 1e-12);
  EXPECT_DOUBLE_EQ(record_.column(record::Channel::motor_torque).front(), -0.01);
  machine("xl330");
  ASSERT_TRUE(read("xl330/2026-01-15_10h28m10.json"));
  const double duty = -9 * 7.3, speed = 1.414868611421723;  // of the last entry: 65527
  EXPECT_NEAR(record_.column(record::Channel::motor_torque).back(), 1.47174e-4 * duty - 0.0476712 * speed,
              1e-12);
}

}  // namespace
}  // namespace backlash::identification
