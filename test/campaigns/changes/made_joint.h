// SPDX-License-Identifier: BSD-3-Clause
// Joints of one inertia or two that the studies of changes draw, and what they measure along random tasks.
// Inverse dynamics with gravity, friction that warms up and wanders by some percent, white and coloured
// noise; tasks are sums of three sines, with rests. Shares no code with the search but the record.
#pragma once

#include <random>
#include <string>

#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::change_study {

using Random = std::mt19937_64;

struct MadeOptions {
  double sampling = 50;  // Hz
  bool two = false;      // inertias
  double wander =
      0.02;             // - of friction, amplitude: up and down in ten minutes, and half of it in one to four
  double wave = 0;      // of the white noise: friction 25 times per rad that no effect has, when healthy
  bool cyclic = false;  // tasks of one sine, of the record that is judged
  double coloured = 0.5;  // - of the white noise, rms of first order noise beside it
};

double uniform(Random& random, double low, double high);

/// What is other from a time on. `effect` is the kind of change; what it is called is another matter.
struct Added {
  std::string effect;
  double since = 1e300, end = 0;  // s; growth reaches `size` at the end
  double size = 0;
  double order = 0, phase = 0;       // 1/rad, rad, of waves
  double place = 0, width = 1;       // rad, of local faults: exp(-((q - place) / width)^2 / 2)
  bool flat = false;                 // the bump is, from place - width to place + width
  double forward = 1, backward = 1;  // - of `size`, that moving so shows of a local fault

  /// `size` where this is `kind` and has begun.
  double of(const char* kind, double t) const { return t >= since && effect == kind ? size : 0; }
  /// The same, growing.
  double growth_of(const char* kind, double t) const;
};

/// Sums of sines.
class Task {
 public:
  /// `cyclic`: one sine, whose reversals are always at the same places.
  Task(Random& random, bool cyclic)
      : amplitudes_{cyclic ? 0 : 0.8, cyclic ? 1 : 0.6, cyclic ? 0 : 0.3},
        f_{uniform(random, 0.09, 0.13), uniform(random, 0.15, 0.2), uniform(random, 0.25, 0.33)},
        phase_(uniform(random, 0, 2 * M_PI)) {}
  double phase() const { return phase_; }
  /// Another task from then on: the same path at another speed.
  void change_speed(double since, double times) {
    since_ = since;
    times_ = times;
  }
  /// Position or its derivative of order 1 or 2.
  double operator()(double t, int order = 0) const;

 private:
  double amplitudes_[3];  // rad
  double f_[3], phase_;
  static constexpr double kSlowly = 3;  // s, over which the speed changes
  double since_ = 1e300, times_ = 1;
};

/// Of one inertia, or of two: then these are the load's, and a motor is before the gap, which is crossed
/// smoothly while the torque of the teeth turns.
struct Joint {
  double inertia, viscous, coulomb, gravity, warm, cooling, noise;
  MadeOptions options;
  double colour_time = 0;  // s
  double wander_time = 0;  // s, of the quicker part
  double stribeck = 0;     // - of dry friction, that it is more at rest
  double motor_inertia = 0, motor_coulomb = 0, backlash = 0, compliance = 0;

  Joint(Random& random, const MadeOptions& made);

  /// `cold`: whether it begins so. Friction wanders.
  record::Record record(Random& random, double duration, bool cold, bool rests,
                        const Added& added = {}) const;

  model::Rig rig() const;

  /// What a change of an effect is measured by.
  double value(const std::string& effect) const;

 private:
  double load(const Task& task, double t, double temperature, const Added& a) const;
  double motor(const Task& task, double t, double temperature, const Added& a) const;
  double torque(const Task& task, double t, double temperature, const Added& a) const;
};

}  // namespace backlash::change_study
