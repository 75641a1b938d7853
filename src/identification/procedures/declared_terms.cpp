// SPDX-License-Identifier: BSD-3-Clause
#include "declared_terms.h"

#include "backlash_diagnosis/identification/fit/servo_data.h"
#include "backlash_diagnosis/model/presliding.h"
#include "backlash_diagnosis/simulation/driven_load.h"

namespace backlash::identification {
namespace {

/// Everything that the motor has to overcome, except inertia.
std::vector<double> resistance(const ServoData& data, const model::Rig& rig) {
  simulation::RecordedMotion motion;
  motion.interval = data.interval;
  motion.start = data.start;
  motion.motor = &data.motor;
  motion.motor_rate = &data.motor_rate;
  motion.acceleration = &data.smooth_acceleration;
  const simulation::MotorTorques torques =
      simulation::motor_torques(rig, motion, simulation::simulate_driven_load(rig, motion));
  std::vector<double> all =
      model::presliding_friction(data.motor, torques.friction, data.motor_rate, data.interval);
  for (std::size_t k = 0; k < all.size(); ++k) all[k] -= torques.mean[k];
  return all;
}

}  // namespace

std::vector<double> torque_of_terms(const record::Record& record, const model::Rig& rig) {
  if (rig.terms.empty()) return {};
  const ServoData data = servo_data(record, rig);
  model::Rig bare = rig;
  bare.terms.clear();
  std::vector<double> torque = resistance(data, rig);
  const std::vector<double> without = resistance(data, bare);
  for (std::size_t k = 0; k < torque.size(); ++k) torque[k] -= without[k];
  return torque;
}

}  // namespace backlash::identification
