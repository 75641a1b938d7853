// SPDX-License-Identifier: BSD-3-Clause
// identify --payload as its users run it. Oracles: a pendulum whose torque is a closed form, and the measured
// arm with a body of 2.805 kg.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/base/random.h"
#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

class KnownWeight : public CommandTest {
 protected:
  Json json(const std::string& name) const { return Json::parse(read(name)); }
};

constexpr double kConstant = 6.1;  // N m per unit
constexpr double kInertia = 0.02, kMoment = 0.3, kCoulomb = 0.2,
                 kViscous = 0.15;                    // kg m^2, N m, N m, N m s/rad
constexpr double kLever = 0.15, kGravity = 9.80665;  // m, m/s^2

/// kConstant u = J a + A sin(q) + friction, with a weight on the lever.
std::string pendulum(double mass, std::uint64_t seed) {
  Random random(seed);
  const double inertia = kInertia + mass * kLever * kLever, moment = kMoment + mass * kGravity * kLever;
  const double phase = random.uniform(0, 6);
  std::string csv = "time,motor_torque,motor_position\n";
  for (int k = 0; k < 2000; ++k) {
    const double t = 0.016 * k, w1 = 1.7, w2 = 4.1;
    const double q = 0.9 * std::sin(w1 * t + phase) + 0.3 * std::sin(w2 * t),
                 v = 0.9 * w1 * std::cos(w1 * t + phase) + 0.3 * w2 * std::cos(w2 * t),
                 a = -0.9 * w1 * w1 * std::sin(w1 * t + phase) - 0.3 * w2 * w2 * std::sin(w2 * t);
    const double torque = inertia * a + moment * std::sin(q) + kCoulomb * std::tanh(v / 0.01) + kViscous * v;
    csv += fmt::format("{:.3f},{:.6g},{:.6g}\n", t, torque / kConstant + 0.004 * random.normal(), q);
  }
  return csv;
}

TEST_F(KnownWeight, OfASingleJointMeasuresItsTorqueConstant) {
  std::filesystem::create_symlink(package_file("config/ur10e_joint.yaml"), path("joint.yaml"));
  write("bare.csv", pendulum(0, 1));
  write("one.csv", pendulum(1, 2));
  write("two.csv", pendulum(2, 3));
  done(
      "identify bare.csv one.csv two.csv --payload \"one.csv=1 kg +- 0.1 % at 0.15 m\" "
      "--payload \"two.csv=2 kg at 150 mm\" --rig joint.yaml --out fitted.yaml");
  const Json parameters = json("fitted.json").at("parameters");
  const auto expect = [&](const char* name, double truth, double share) {
    const double value = parameters.at(name).at("value"), error = parameters.at(name).at("standard_error");
    EXPECT_NEAR(value, truth, share * truth) << name;
    EXPECT_NEAR(value, truth, 4 * error) << name;  // beyond 4 once in 16000
  };
  expect("torque_constant", kConstant, 0.02);
  expect("gravity_amplitude", kMoment, 0.03);
  expect("inertia", kInertia, 0.1);
  expect("coulomb", kCoulomb, 0.05);
  expect("viscous", kViscous, 0.05);
  const std::string rig = read("fitted.yaml");
  expect_contains(rig, "torque_constant: 6.");
  expect_contains(rig, "id: gravity");
  EXPECT_EQ(run("simulate fitted.yaml --duration 1 --out again.csv").code, 0);
  // A weight without its lever, and one that nobody knows, measure nothing.
  EXPECT_EQ(
      run("identify one.csv bare.csv --payload \"1 kg\" --rig joint.yaml --out f.yaml --json f.json").code,
      64);
  EXPECT_EQ(
      run("identify one.csv bare.csv --payload unknown --rig joint.yaml --out f.yaml --json f.json").code,
      64);
  EXPECT_EQ(run("identify one.csv bare.csv --payload heavy --rig joint.yaml --out f.yaml --json f.json").code,
            64);
  EXPECT_EQ(
      run("identify one.csv --payload \"1 kg at 0.15 m\" --rig joint.yaml --out f.yaml --json f.json").code,
      3);
}

class MeasuredWeight : public KnownWeight {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    std::filesystem::create_directory_symlink(package_file("config/ur10e_arm"), path("rig"));
    for (const char* name : {"a", "free", "payload"}) {
      const auto record = find_data("measured/ur5_arm_" + std::string(name) + ".csv");
      if (!record) GTEST_SKIP() << "no measured/ur5_arm_" << name << ".csv: set BACKLASH_DIAGNOSIS_DATA";
      std::filesystem::create_symlink(std::filesystem::absolute(*record), path(std::string(name) + ".csv"));
    }
  }
};

constexpr double kTruth = 2.805;  // kg, stated by those who mounted it

TEST_F(MeasuredWeight, MeasuresTheConstantsOfTheArm) {
  done(
      "identify payload.csv free.csv --payload \"2.805 kg +- 0.005\" --rig rig/ur10e_arm.yaml --out "
      "fitted.yaml --json fit.json");
  const Json fit = json("fit.json");
  EXPECT_EQ(fit.at("common_scale").at("from"), "weight");
  EXPECT_LT(fit.at("common_scale").at("uncertainty"), 0.03);  // declared: 0.15
  for (const auto& [name, link] : fit.at("links").items()) EXPECT_TRUE(link.at("consistent")) << name;
  EXPECT_TRUE(fit.at("not_identifiable").at("shoulder_link/mass").at("interval").is_null());
  EXPECT_FALSE(fit.at("not_identifiable").contains("shoulder_link/inertia_zz"));
  done("trace_residual --rig fitted.yaml --train a.csv --test payload.csv --out out");
  const Json step = json("out/report.json").at("steps").at(0);
  const Json mass = step.at("parameters").at("mass");
  EXPECT_NEAR(mass.at("value").get<double>(), kTruth, 0.02 * kTruth);
  EXPECT_NEAR(mass.at("value").get<double>(), kTruth, 2 * mass.at("standard_error").get<double>());
  done("export_model --urdf rig/ur10e_arm.urdf --rig fitted.yaml --out identified.urdf");
  expect_contains(read("identified.urdf"),
                  "<mass value=\"7.369\"/>");  // of the first link, which no motion shows
}

TEST_F(MeasuredWeight, WithoutItTheIntervalHoldsTheTruth) {
  done(
      "identify payload.csv free.csv --payload unknown --rig rig/ur10e_arm.yaml --out fitted.yaml --json "
      "fit.json");
  const Json fit = json("fit.json");
  EXPECT_EQ(fit.at("common_scale").at("from"), "declared");
  expect_contains(fit.at("common_scale").at("message").get<std::string>(), "declared torque constants");
  const Json mass = fit.at("payloads").at(0).at("mass");
  EXPECT_NEAR(mass.at("value").get<double>(), kTruth, 2 * mass.at("standard_error").get<double>());
}

}  // namespace
}  // namespace backlash::test
