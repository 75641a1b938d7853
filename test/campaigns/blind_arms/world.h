// SPDX-License-Identifier: BSD-3-Clause
// A drawn arm in MuJoCo: its chain is MuJoCo's, drives, teeth and friction are torques put on it.
//
// Each joint is a chain of hinges about its axis: the motor (its rotor's inertia counts between it and the
// link before), the link against the motor, and where the link bends its second part against the first.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>
#include <vector>

#include "blind_arm.h"

namespace blind_arms {

constexpr double kTimeStep = 2.5e-5;  // s: 200 in a cycle of 200 Hz

/// The model as MuJoCo reads it.
std::string world_xml(const Arm& arm);

class World {
 public:
  /// Writes the model to `path` for MuJoCo to read. Throws std::runtime_error.
  World(const Arm& arm, const std::string& path);

  /// Moves by kTimeStep under these torques of the motors [N m].
  void step(const std::vector<double>& motors);

  double time() const { return data_->time; }
  double motor(std::size_t joint) const { return data_->qpos[joints_[joint].motor]; }
  double motor_rate(std::size_t joint) const { return data_->qvel[joints_[joint].motor]; }
  /// Before the bend, where the link has one: where an encoder sits.
  double link(std::size_t joint) const { return motor(joint) + data_->qpos[joints_[joint].link]; }
  double link_rate(std::size_t joint) const { return motor_rate(joint) + data_->qvel[joints_[joint].link]; }
  double twist(std::size_t joint) const { return -data_->qpos[joints_[joint].link]; }
  /// Gravity and what the speeds do, as of the last step [N m].
  double bias(std::size_t joint) const { return data_->qfrc_bias[joints_[joint].motor]; }
  /// Of motion, weight, teeth and bends [J].
  double energy() const;

 private:
  struct Places {
    int motor = 0, link = 0, bend = -1;  // of coordinates and speeds, which are hinges only
  };
  struct Friction {
    double motor = 0, link = 0;  // N m, of bristles
  };
  double dry_friction(std::size_t joint) const;
  double friction(std::size_t joint);
  double drive_torque(const std::vector<double>& motors, std::size_t joint) const;

  Arm arm_;
  std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model_;
  std::unique_ptr<mjData, decltype(&mj_deleteData)> data_;
  std::vector<Places> joints_;
  std::vector<Friction> bristles_;
  int last_body_ = 0;
};

}  // namespace blind_arms
