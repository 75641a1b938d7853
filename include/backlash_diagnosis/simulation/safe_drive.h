// SPDX-License-Identifier: BSD-3-Clause
// Drives a real joint through an excitation within limits: what torque to command now, and when to stop. Time
// is passed in, so that it runs in a test as it does beside a robot. Once it has ended its torque is zero for
// ever.
//
//   command(t) = ramp(t) * excitation(t),  ramp: half cosine from 0 to 1 and, at the end, back to 0
//
// Before that the joint is watched at rest; what its position scatters there is its noise.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/simulation/excitation.h"

namespace backlash::simulation {

/// All must be given. Positions and speeds are those of the channel motor_position.
struct DriveLimits {
  double torque = kNaN;    // N m, > 0: no plan exceeds it
  double speed = kNaN;     // rad/s, > 0
  double lower = kNaN;     // rad
  double upper = kNaN;     // rad, > lower
  double duration = kNaN;  // s, > 0: no plan is longer
};

/// Origin of all: choice.
struct SafeDriveSettings {
  double ramp = 0.5;       // s, at the start and at the end, > 0
  double rest = 0.5;       // s, how long the joint is watched before it is driven, > 0
  double state_age = 0.1;  // s, an older state stops the run, > 0
  double still = 2;        // s at half of the largest torque or more in which something must move, > 0
};

struct DrivePlan {
  std::vector<double> time, torque;  // s, N m
  double largest_torque = 0;         // N m
};

class SafeDrive {
 public:
  /// Throws InvalidParameter for a limit that is missing (by its name) or wrong, for a plan that exceeds the
  /// torque or the duration, and for an excitation that needs more than a torque at the motor.
  SafeDrive(const ExcitationSettings& excitation, double duration, const DriveLimits& limits,
            const SafeDriveSettings& settings = {});

  /// The torque that is meant, each millisecond; the drive need not be started.
  const DrivePlan& plan() const { return plan_; }

  /// From then on [s, any origin]. Zero torque until the joint has been watched.
  void start(double now);

  /// A state of the joint that came at `now` and was measured at `stamp` [s], position [rad]; a velocity
  /// [rad/s] that is absent is taken from positions.
  void take(double now, double stamp, double position, std::optional<double> velocity);

  /// Torque [N m] to command at `now`.
  double torque(double now);

  /// Ends the run; the first reason stays.
  void stop(const std::string& reason);

  bool ended() const { return ended_; }
  /// Whether the whole run was driven; then there is no reason.
  bool done() const { return ended_ && reason_.empty(); }
  const std::string& reason() const { return reason_; }
  /// 0 .. 1 of the run.
  double fraction(double now) const;

 private:
  struct State {
    double stamp, position;
  };

  void make_plan();
  double planned(double t) const;
  void watch(const State& state);
  void end_of_rest();
  void check_motion(const State& state, std::optional<double> velocity);
  void check_work(const State& state);
  void check_movement(double now);
  double speed(const State& state) const;

  ExcitationSettings excitation_;
  double duration_;  // s
  DriveLimits limits_;
  SafeDriveSettings settings_;
  DrivePlan plan_;

  bool started_ = false, driving_ = false, ended_ = false;
  std::string reason_;
  double begin_ = 0;           // s, of the rest, then of the drive
  double last_come_ = 0;       // s, when the last state came
  double last_now_ = 0;        // s, of the last command
  double command_ = 0;         // N m, the last one
  std::vector<State> recent_;  // as long as a speed needs
  long states_ = 0;
  double lowest_ = 0, highest_ = 0;   // rad, of the rest, then of the drive
  double noise_ = 0;                  // rad
  double resolution_ = 0;             // rad, smallest step of the position that was seen; 0: none yet
  double loaded_ = 0;                 // s at half of the largest torque or more
  double work_ = 0, moved_work_ = 0;  // J: torque times path, and of its parts without sign
};

}  // namespace backlash::simulation
