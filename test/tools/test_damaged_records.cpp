// SPDX-License-Identifier: BSD-3-Clause
// Joints of a separate simulator with one effect that the rig file lacks (data/README.md), their records
// whole and damaged as recordings get: the same effect is named first, and what is left is as little.
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
