// SPDX-License-Identifier: BSD-3-Clause
// A motor behind a locked output and its records, for tests of lost_motion; expectations of its estimates.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/lost_motion.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::diagnosis::locked_motor {

// Motor behind a locked output, quasi-static: gap g, compliance c on the flanks, Coulomb friction Fc at the
// motor. It rests while abs(u - f(x)) <= Fc and else follows u -+ Fc along the flank characteristic.
struct Machine {
  double gap = 0.02, compliance = 1e-3, coulomb = 0.5;
  double position = 0;

  double held(double x) const {
    return std::abs(x) <= gap / 2 ? 0 : (x - std::copysign(gap / 2, x)) / compliance;
  }
  double step(double torque) {
    if (torque - coulomb > held(position)) position = flank(torque - coulomb);
    if (torque + coulomb < held(position)) position = flank(torque + coulomb);
    return position;
  }
  double flank(double torque) const {
    return torque == 0 ? position : std::copysign(gap / 2, torque) + compliance * torque;
  }
  // Closed form of the play at +-torque on the unloading branch after a peak: friction holds the motor there
  // until torque has fallen by 2 Fc.
  double play(double torque, double peak) const {
    return gap + 2 * compliance * std::min(peak - coulomb, torque + coulomb);
  }
};

enum class Wave { triangle, sine, square };

inline double wave(Wave shape, double phase) {
  phase -= std::floor(phase);
  if (shape == Wave::sine) return std::sin(2 * M_PI * phase);
  if (shape == Wave::square) return phase < 0.5 ? 1 : -1;
  return phase < 0.25 ? 4 * phase : phase < 0.75 ? 2 - 4 * phase : 4 * phase - 4;
}

struct Experiment {
  Wave shape = Wave::triangle;
  double amplitude = 4, frequency = 0.25, duration = 20, rate = 400;
  double torque_noise = 0, position_noise = 0, offset = 0, drift = 0;
  std::vector<std::pair<double, double>> slips;  // s, rad: from this half period on until the next
  unsigned seed = 1;
};

inline record::Record run(Machine machine, const Experiment& e) {
  record::Record record;
  Random generator(e.seed);
  const auto samples = static_cast<std::size_t>(e.duration * e.rate);
  for (std::size_t i = 0; i < samples; ++i) {
    const double time = static_cast<double>(i) / e.rate;
    const double torque = e.amplitude * wave(e.shape, time * e.frequency);
    double position =
        machine.step(torque) + e.offset + e.drift * time + e.position_noise * generator.normal();
    for (const auto& [from, size] : e.slips) {
      if (time >= from && time < from + 0.5 / e.frequency) position += size;
    }
    record.time.push_back(time);
    record.column(record::Channel::motor_torque).push_back(torque + e.torque_noise * generator.normal());
    record.column(record::Channel::motor_position).push_back(position);
  }
  return record;
}

inline LostMotionSettings at(double torque) {
  LostMotionSettings settings;
  settings.torque = torque;
  return settings;
}

inline LostMotionSettings without_deflection(double torque, double compliance) {
  LostMotionSettings settings = at(torque);
  settings.subtract_elastic_deflection = true;
  settings.elastic_deflection = [compliance](double u) { return compliance * u; };
  return settings;
}

inline void expect_contains(const Estimate& estimate, double truth) {
  EXPECT_EQ(estimate.status, Status::ok) << estimate.message;
  EXPECT_LE(estimate.angle_lower, truth);
  EXPECT_GE(estimate.angle_upper, truth);
}

inline void expect_refusal(const Estimate& estimate, Status status, const std::string& words) {
  EXPECT_EQ(estimate.status, status) << estimate.message;
  EXPECT_NE(estimate.message.find(words), std::string::npos) << estimate.message;
  EXPECT_TRUE(std::isnan(estimate.backlash_angle));
  EXPECT_TRUE(std::isnan(estimate.angle_lower));
  EXPECT_FALSE(estimate.components);
}

}  // namespace backlash::diagnosis::locked_motor
