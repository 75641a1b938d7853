// SPDX-License-Identifier: BSD-3-Clause
// Joints of a separate simulator with one effect that the rig file lacks, or that changes while they work
// (data/README.md), their records whole and damaged as recordings get: the same effect is named first, and
// what is left is as little; the same change since the same time.
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/record/csv.h"
#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;
using record::Channel;
using record::Record;
using Damage = std::function<Record(Record)>;

Record without(const Record& r, const std::function<bool(std::size_t)>& is_lost) {
  std::vector<double> kept;
  for (std::size_t k = 0; k < r.size(); ++k)
    if (!is_lost(k)) kept.push_back(r.time[k]);
  return record::samples_at(r, kept);
}

Record one_of_twenty_lost(const Record& r) {
  Random random(5);
  return without(r, [&](std::size_t) { return random.uniform() < 0.05; });
}

Record a_gap_in_the_middle(const Record& r) {
  return without(r, [&](std::size_t k) { return k > r.size() / 2 && k < r.size() / 2 + 200; });
}

Record wild_samples(Record r) {
  for (std::size_t i = 1; i <= 8; ++i) {
    const std::size_t row = i * r.size() / 9;
    (i % 2 == 0 ? r.column(Channel::motor_position)[row] : r.column(Channel::motor_torque)[row]) += 400;
  }
  return r;
}

Record messages_of_zeros(Record r) {
  for (std::size_t i = 1; i <= 5; ++i)
    for (const Channel channel : {Channel::motor_position, Channel::motor_torque})
      r.column(channel)[i * r.size() / 6] = 0;
  return r;
}

/// Stamps off by up to a fifth of an interval.
Record late_stamps(Record r) {
  Random random(7);
  const double interval = r.sampling_interval();
  for (double& t : r.time) t += interval * (0.4 * random.uniform() - 0.2);
  return r;
}

/// The encoder stands still for 12 s.
Record a_frozen_encoder(Record r) {
  std::vector<double>& q = r.column(Channel::motor_position);
  for (std::size_t k = 0; k < r.size(); ++k)
    if (r.time[k] > 60 && r.time[k] < 72) q[k] = q[k - 1];
  return r;
}

class DamagedRecords : public CommandTest {
 protected:
  /// Names the effect of the joint first, and leaves at most twice the noise.
  void names(const std::string& joint, const std::string& effect, const Damage& damage) {
    const auto rig = find_data("robot_joints/" + joint + "/rig.yaml");
    if (!rig) GTEST_SKIP() << "no robot_joints (BACKLASH_DIAGNOSIS_DATA)";
    for (const std::string& part : {"train", "test"})
      record::write_csv(damage(record::read_csv(*find_data("robot_joints/" + joint + "/" + part + ".csv"))),
                        path(part + ".csv"));
    done("trace_residual --rig " + *rig + " --train train.csv --test test.csv --out traced");
    const Json report = Json::parse(read("traced/report.json"));
    ASSERT_FALSE(report["steps"].empty()) << report["message"];
    EXPECT_EQ(report["steps"][0]["effect"], effect);
    const Json& torque = report["channels"]["torque"];
    EXPECT_LT(torque["after"].get<double>(), 2 * torque["floor"].get<double>());
  }
};

struct ChangedRecords : CommandTest {
  /// Of records that are all damaged, the change and nothing else.
  void names(const std::string& folder, const std::string& rig, const std::string& record,
             const std::string& effect, double since, const Damage& damage) {
    if (!find_data(folder + record)) GTEST_SKIP() << "no " << folder << " (BACKLASH_DIAGNOSIS_DATA)";
    for (const std::string& file : {std::string("healthy_a.csv"), std::string("healthy_b.csv"), record})
      record::write_csv(damage(record::read_csv(*find_data(folder + file))), path(file));
    const Outcome outcome =
        run("detect_changes --rig " + rig + " --healthy healthy_a.csv healthy_b.csv --json x.json " + record);
    ASSERT_EQ(outcome.code, effect.empty() ? 0 : 2) << outcome.out << outcome.err;
    const Json changes = Json::parse(read("x.json"))["changes"];
    if (effect.empty()) return;
    ASSERT_EQ(changes.size(), 1u) << outcome.out;
    EXPECT_EQ(changes[0]["effect"], effect);
    EXPECT_LE(changes[0]["since_interval"][0].get<double>(), since + 0.5);  // 95 %, and a window of 0.5 s
    EXPECT_GE(changes[0]["since_interval"][1].get<double>(), since - 0.5);
  }
  std::string declared() const { return package_file("config/ur5_joint.yaml"); }
};

TEST_F(ChangedRecords, StampsThatJitterAreNoChange) {
  names("changes/", declared(), "ok.csv", "", 0, late_stamps);
}

TEST_F(ChangedRecords, StampsThatJitterHideNoChange) {
  names("changes/", declared(), "friction_up.csv", "motor_coulomb", 141.04, late_stamps);
}

TEST_F(ChangedRecords, AnEncoderThatStoodStillCostsThatTime) {
  names("changes/", declared(), "friction_up.csv", "motor_coulomb", 141.04, a_frozen_encoder);
}

// Its clock begins anew between the samples of the first part.
TEST_F(ChangedRecords, ASlowerDriveIsADelay) {
  const auto rig = find_data("robot_joints/joint_12/rig.yaml");
  names("robot_joints/joint_12/", rig ? *rig : "", "today.csv", "delay", 80, [](Record r) { return r; });
}

TEST_F(DamagedRecords, OfAJointWithCogging) {
  names("joint_06", "cogging", [](Record r) { return wild_samples(messages_of_zeros(std::move(r))); });
}

// At 500 Hz one sample of twenty that is lost hardly leaves a twentieth of a second without one.
TEST_F(DamagedRecords, OfAJointWithFrictionByPosition) {
  names("joint_09", "position_dependent_friction", one_of_twenty_lost);
}

// Behind the gap the friction has drifted on. The whole record leaves a little more than twice the noise.
TEST_F(DamagedRecords, OfAJointThatWarmsUp) {
  names("joint_14", "friction_drift", a_gap_in_the_middle);
}

// Two waves of low order would explain the constant, with strengths that the records do not determine.
TEST_F(DamagedRecords, OfAJointWithAConstantTorque) {
  names("joint_13", "asymmetric_coulomb", [](Record r) { return r; });
}

}  // namespace
}  // namespace backlash::test
