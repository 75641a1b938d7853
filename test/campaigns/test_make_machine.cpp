// SPDX-License-Identifier: BSD-3-Clause
// The generator of test machines against Newton's law, written down here anew: for a torque that is held
// between samples, second differences of J_M q_M + J_L q_L are exact, so nothing but noise and quantisation
// may remain.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "machine_folder.h"

namespace backlash::test {
namespace {

constexpr double kInterval = 1e-3;  // s
constexpr int kReach = 40;          // samples, half of what the low-pass looks at

struct MachineRecord {
  Values torque, motor, load;
};

/// Hann window, sum 1.
Values window() {
  Values weights;
  for (int i = -kReach; i <= kReach; ++i) {
    weights.push_back((1 + std::cos(M_PI * i / (kReach + 1))) / 2 / (kReach + 1));
  }
  return weights;
}

/// Low-passed; 0 where the window does not fit.
Values smooth(const Values& signal) {
  const Values weights = window();
  Values result(signal.size(), 0.0);
  for (std::size_t k = kReach; k + kReach < signal.size(); ++k) {
    for (std::size_t i = 0; i < weights.size(); ++i) result[k] += weights[i] * signal[k - kReach + i];
  }
  return result;
}

Values speed(const Values& position) {
  Values result(position.size(), 0.0);
  for (std::size_t k = 1; k + 1 < position.size(); ++k) {
    result[k] = (position[k + 1] - position[k - 1]) / (2 * kInterval);
  }
  return result;
}

Values acceleration(const Values& position) {
  Values result(position.size(), 0.0);
  for (std::size_t k = 1; k + 1 < position.size(); ++k) {
    result[k] = (position[k + 1] - 2 * position[k] + position[k - 1]) / (kInterval * kInterval);
  }
  return result;
}

/// Standard deviation that white noise of 1 keeps behind the low-pass, and as an acceleration behind it.
double noise_gain() {
  double sum = 0;
  for (double w : window()) sum += w * w;
  return std::sqrt(sum);
}
double acceleration_gain() {
  Values weights = window();
  weights.insert(weights.begin(), 2, 0.0);
  weights.insert(weights.end(), 2, 0.0);
  double sum = 0;
  for (double w : acceleration(weights)) sum += w * w;
  return std::sqrt(sum);
}

double median_size(Values values) {
  for (double& v : values) v = std::abs(v);
  std::nth_element(values.begin(), values.begin() + static_cast<long>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

class MakeMachine : public MachineFolder {
 protected:
  void make(const std::string& arguments, const std::string& folder = "machine") {
    done("make_machine " + arguments + " --out " + folder);
    truth_ = nlohmann::json::parse(read(folder + "/truth.json"));
    train_ = record(folder + "/train.csv");
    test_ = record(folder + "/test.csv");
  }

  MachineRecord record(const std::string& name) const {
    std::istringstream text(read(name));
    std::string line;
    std::getline(text, line);
    EXPECT_EQ(line, "time,motor_torque,motor_position,load_position");
    MachineRecord result;
    double time, torque, motor, load;
    char comma;
    while (text >> time >> comma >> torque >> comma >> motor >> comma >> load) {
      EXPECT_NEAR(time, kInterval * static_cast<double>(result.torque.size()), 1e-9);
      result.torque.push_back(torque);
      result.motor.push_back(motor);
      result.load.push_back(load);
    }
    return result;
  }

  double rig(const char* name) const { return truth_["rig"][name]["value"]; }

  using Extra = std::function<double(double position)>;

  /// What the momentum of both bodies leaves unexplained [N m], low-passed, while both slide the same way;
  /// `extra` opposes.
  Values momentum_residual(const MachineRecord& record, const Extra& extra) const {
    const Values motor = acceleration(record.motor), load = acceleration(record.load);
    const Values motor_speed = speed(record.motor), load_speed = speed(record.load);
    const Values motor_slow = speed(smooth(record.motor)), load_slow = speed(smooth(record.load));
    Values rest(motor.size(), 0.0);
    for (std::size_t k = 1; k + 1 < rest.size(); ++k) {
      const double dry = rig("motor_coulomb") + rig("load_coulomb");
      rest[k] = (record.torque[k] + record.torque[k - 1]) / 2 - rig("motor_inertia") * motor[k] -
                rig("load_inertia") * load[k] - rig("motor_viscous") * motor_speed[k] -
                rig("load_viscous") * load_speed[k] - std::copysign(dry, motor_slow[k]) -
                extra(record.motor[k]);
    }
    const Values low = smooth(rest);
    Values sliding;
    // 0.1 rad/s: neither body comes near a stop within the window, whatever the low-pass hides
    std::size_t since = 0;
    for (std::size_t k = 2 * kReach; k + 2 * kReach < rest.size(); ++k) {
      const bool slides =
          motor_slow[k] * load_slow[k] > 0 && std::abs(motor_slow[k]) > 0.1 && std::abs(load_slow[k]) > 0.1;
      since = slides ? since + 1 : 0;
      if (since > 4 * kReach) sliding.push_back(low[k - 2 * kReach]);
    }
    EXPECT_GT(sliding.size(), 3000u);
    return sliding;
  }

  /// Noise that the residual must have [N m]: the torque's (mean of two samples) and both encoders'.
  double expected_noise() const {
    const double resolution =
        std::hypot(rig("motor_inertia") * truth_["made_with"]["motor_resolution"].get<double>(),
                   rig("load_inertia") * truth_["made_with"]["load_resolution"].get<double>());
    return std::hypot(rig("torque_noise_sd") * noise_gain(),
                      resolution / std::sqrt(12.0) * acceleration_gain());
  }

  void expect_balance(const Extra& extra = [](double) { return 0.0; }) const {
    for (const MachineRecord* r : {&train_, &test_}) {
      const Values residual = momentum_residual(*r, extra);
      // Some 40 independent windows per 3000 samples: their scatter is known to 11 %, 3 of these. Half a
      // newton metre of a forgotten torque would raise it by more.
      EXPECT_NEAR(rms(residual) / expected_noise(), 1, 0.35);
    }
  }

  MachineRecord train_, test_;
};

TEST_F(MakeMachine, SameSeedSameBytes) {
  const std::string how = "--effects varying_backlash,stribeck --duration 3 ";
  make(how + "--seed 5", "a");
  make(how + "--seed 5", "b");
  make(how + "--seed 6", "c");
  for (const char* file : {"/train.csv", "/test.csv", "/truth.json"}) {
    EXPECT_EQ(read(std::string("a") + file), read(std::string("b") + file)) << file;
    EXPECT_NE(read(std::string("a") + file), read(std::string("c") + file)) << file;
  }
}

TEST_F(MakeMachine, TrainAndTestDiffer) {
  make("--seed 7 --duration 10");
  ASSERT_EQ(train_.motor.size(), 10000u);
  ASSERT_EQ(test_.motor.size(), 10000u);
  Values difference;
  for (std::size_t k = 0; k < train_.motor.size(); ++k)
    difference.push_back(train_.motor[k] - test_.motor[k]);
  EXPECT_GT(rms(difference), 0.1);  // rad, of travels of a radian
}

TEST_F(MakeMachine, EncodersHaveTheirResolution) {
  for (const char* bits : {"0", "14"}) {
    make(std::string("--seed 8 --duration 3 --encoder-bits ") + bits);
    const double motor = truth_["made_with"]["motor_resolution"],
                 load = truth_["made_with"]["load_resolution"];
    EXPECT_DOUBLE_EQ(load, *bits == '0' ? 7e-6 : 2 * M_PI / 16384);
    double smallest = 1;
    for (std::size_t k = 1; k < train_.load.size(); ++k) {
      // written with 1e-9 rad
      EXPECT_NEAR(train_.load[k], std::round(train_.load[k] / load) * load, 1e-9);
      EXPECT_NEAR(train_.motor[k], std::round(train_.motor[k] / motor) * motor, 1e-9);
      const double step = std::abs(train_.load[k] - train_.load[k - 1]);
      if (step > load / 2) smallest = std::min(smallest, step);
    }
    EXPECT_NEAR(smallest, load, 2e-9);
  }
}

TEST_F(MakeMachine, TheLoadEncoderIsLateByTheSkew) {
  make("--seed 9 --duration 2");
  const Values motor = train_.motor, load = train_.load;
  make("--seed 9 --duration 2 --skew 0.005");
  EXPECT_EQ(train_.motor, motor);
  for (std::size_t k = 5; k < load.size(); ++k) ASSERT_EQ(train_.load[k], load[k - 5]) << k;  // at 1 kHz
}

// The same machine with other noise: what differs is the noise of both.
TEST_F(MakeMachine, TheNoiseHasTheAskedForColour) {
  make("--seed 10 --duration 20 --noise 0");
  const Values without = train_.torque;
  make("--seed 10 --duration 20 --noise-corner 8");
  Values noise;
  double product = 0, square = 0;
  for (std::size_t k = 0; k < without.size(); ++k) noise.push_back(train_.torque[k] - without[k]);
  for (std::size_t k = 1; k < noise.size(); ++k)
    product += noise[k] * noise[k - 1], square += noise[k] * noise[k];
  // Of 20 s with a memory of 20 ms: about 500 independent values, so 3 % each way; twice that here.
  EXPECT_NEAR(rms(noise) / rig("torque_noise_sd"), 1, 0.1);
  EXPECT_NEAR(product / square, std::exp(-2 * M_PI * 8e-3), 0.01);
}

TEST_F(MakeMachine, ParametersAreNearTheDeclared) {
  for (int seed = 0; seed < 10; ++seed) {
    make("--duration 1 --seed " + std::to_string(seed));
    EXPECT_NEAR(rig("motor_inertia") / 6.3, 1, 0.4);
    EXPECT_NEAR(rig("mesh_stiffness") / 460e3, 1, 0.4);
    EXPECT_NEAR(rig("backlash_angle") / 5.4e-4, 1, 0.4);
    EXPECT_NEAR(rig("torque_noise_sd"), 2, 1);
  }
}

TEST_F(MakeMachine, KeepsMomentum) {
  make("--seed 1 --duration 30");
  EXPECT_TRUE(truth_["undeclared_effects"].empty());
  expect_balance();
}

TEST_F(MakeMachine, KeepsMomentumWithOtherFrictionAndContact) {
  make("--seed 2 --duration 30 --friction lugre --contact hertz --no-dither");
  expect_balance();
}

TEST_F(MakeMachine, GravityIsAsTheTruthSays) {
  make("--seed 3 --duration 30 --effects gravity");
  EXPECT_GT(rms(momentum_residual(train_, [](double) { return 0.0; })), 10 * expected_noise());
  expect_balance([this](double q) { return of("gravity", "A") * std::sin(q + of("gravity", "p")); });
}

TEST_F(MakeMachine, CoggingIsAsTheTruthSays) {
  make("--seed 4 --duration 30 --effects cogging");
  expect_balance([this](double q) {
    return of("cogging", "A") * std::sin(of("cogging", "n") * q + of("cogging", "p"));
  });
}

TEST_F(MakeMachine, OrdersMayBeAskedFor) {
  make("--seed 5 --effects cogging,transmission_error,varying_backlash --order 18.667 --duration 1");
  EXPECT_EQ(of("cogging", "n"), 18.667);
  EXPECT_EQ(of("transmission_error", "n"), 18.667);
  EXPECT_EQ(of("varying_backlash", "n1"), 18.667);
  make("--seed 4 --duration 30 --effects cogging --order 18.667");
  expect_balance([this](double q) { return of("cogging", "A") * std::sin(18.667 * q + of("cogging", "p")); });
}

TEST_F(MakeMachine, TeethAreAsTheTruthSays) {
  make("--seed 9 --duration 30 --effects transmission_error");
  const double a = of("transmission_error", "A"), n = of("transmission_error", "n");
  const double p = of("transmission_error", "p");
  const Values load = smooth(train_.load), push = acceleration(load), turning = speed(load);
  Values displacement, torque;
  for (std::size_t k = 0; k < load.size(); ++k) {
    const double q = train_.load[k];
    displacement.push_back(train_.motor[k] - q + a * std::sin(n * q + p));
    // By virtual work the load feels T (1 - a n cos).
    torque.push_back(
        (rig("load_inertia") * push[k] + rig("load_coulomb") + rig("load_viscous") * turning[k]) /
        (1 - a * n * std::cos(n * q + p)));
  }
  const Values closed = smooth(displacement), rate = speed(closed);
  Values residual;
  std::size_t since = 0;
  for (std::size_t k = 2 * kReach; k + 2 * kReach < load.size(); ++k) {
    since = torque[k] > 60 && turning[k] > 0.05 ? since + 1 : 0;
    if (since <= 2 * kReach) continue;
    const std::size_t middle = k - kReach;  // the forward flank is in touch through the whole window
    residual.push_back(closed[middle] - rig("backlash_angle") / 2 -
                       (torque[middle] - rig("mesh_damping") * rate[middle]) / rig("mesh_stiffness"));
  }
  ASSERT_GT(residual.size(), 1000u);
  // The load encoder's steps, as an angle and as the torque that follows from them. The median, for a
  // low-passed torque does not show every bounce; half more, as the steps are not quite white. The
  // transmission error is 4e-5 rad and more.
  const double steps = 7e-6 / std::sqrt(12.0);
  const double noise =
      steps * std::hypot(noise_gain(), acceleration_gain() * rig("load_inertia") / rig("mesh_stiffness"));
  EXPECT_LT(median_size(residual) / 0.6745, 1.5 * noise);
}

TEST_F(MakeMachine, ServosMayHaveAnotherRate) {
  done("make_machine --seed 3 --rate 2000 --duration 2 --out fast");
  const Values time = column("fast/train.csv", 0);
  ASSERT_EQ(time.size(), 4000u);
  for (std::size_t k = 0; k < time.size(); ++k) ASSERT_NEAR(time[k], 5e-4 * double(k), 1e-9);
}

TEST_F(MakeMachine, StrengthIsTimesWhatIsDrawn) {
  const std::string how = "--seed 6 --duration 1 --effects gravity,cogging,delay,stribeck";
  make(how);
  const nlohmann::json whole = truth_["undeclared_effects"];
  make(how + " --strength 0.25");
  for (const char* id : {"gravity", "cogging", "delay", "stribeck"})
    EXPECT_DOUBLE_EQ(of(id, "A"), 0.25 * whole[id]["A"].get<double>()) << id;
}

TEST_F(MakeMachine, AServoOfAnotherBuildHasSoManyTimesTheValues) {
  make("--seed 6 --duration 1");
  const nlohmann::json usual = truth_["rig"];
  make("--seed 6 --duration 1 --times backlash_angle=8,load_inertia=0.03");
  for (const auto& [name, value] : usual.items()) {
    const double times = name == "backlash_angle" ? 8 : name == "load_inertia" ? 0.03 : 1;
    EXPECT_NEAR(truth_["rig"][name]["value"].get<double>() / value["value"].get<double>(), times, 1e-12)
        << name;
  }
}

// The loop keeps its rate: a record of each fifth sample is of the same motion.
TEST_F(MakeMachine, ASlowRecorderLeavesSamplesOut) {
  make("--seed 6 --duration 2");
  const Values whole = column("machine/train.csv", 2);
  done("make_machine --seed 6 --duration 2 --rate 200 --out slow");
  const Values part = column("slow/train.csv", 2);
  ASSERT_EQ(part.size(), 400u);
  for (std::size_t k = 0; k < part.size(); ++k) ASSERT_EQ(part[k], whole[5 * k]) << k;
}

TEST_F(MakeMachine, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(run("make_machine --seed 1 --out x --machine crane").code, 64);
  EXPECT_EQ(run("make_machine --seed 1 --out x --machine joint --effects transmission_error").code, 64);
  EXPECT_EQ(run("make_machine --seed 1 --out x --rate 1").code, 64);
  for (const char* times :
       {"colour=2", "backlash_angle", "backlash_angle=", "backlash_angle=0", "backlash_angle=2x"})
    EXPECT_EQ(run(std::string("make_machine --seed 1 --out x --times ") + times).code, 64) << times;
  EXPECT_EQ(run("make_machine --seed 1 --out x --strength -1").code, 64);
  EXPECT_EQ(run("make_machine --seed 1 --out x --effects rust").code, 64);
  EXPECT_EQ(run("make_machine --seed 1 --out x --friction oil").code, 64);
  EXPECT_EQ(run("make_machine --seed 1 --out x --order -3").code, 64);
  EXPECT_EQ(run("make_machine --seed 1 --out x --skew -0.001").code, 64);
  EXPECT_EQ(run("make_machine --seed 1 --out x --noise-corner -1").code, 64);
  EXPECT_EQ(run("make_machine --out x").code, 64);
  EXPECT_FALSE(exists("x"));
}

}  // namespace
}  // namespace backlash::test
