// SPDX-License-Identifier: BSD-3-Clause
// What half a minute of a joint's motion shows of its machine, as values to begin a rig file with: nothing is
// declared yet. All at the axis of motor_position, in the unit of the torque that was recorded.
//
//   tau = J a + d w + C sign(w) + o [+ G sin(q + p)]
//
// in a band in which motor and load move as one, by least squares; standard errors by the scatter of four
// parts of the record. Beside two encoders the range of motor minus load position says how far play and
// yielding teeth go together; the two are not distinguished here, a diagnosis does that.
#pragma once

#include <optional>
#include <string>

#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/record/record_check.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::rig_draft {

struct SeenTorque {
  record::Channel channel = record::Channel::motor_torque;  // or motor_current
  double explained = 0;  // share of its variance that a motion as above takes; 0 to 1
  double size = 0;       // half of its range, but for the rarest 1 %
  double load = 0;       // the same of what is left for the load: without friction, half of the inertia
  signal::Measured inertia, coulomb, viscous;  // kg m^2, N m, N m s/rad; >= 0, 0 where the record shows none
  // G [N m], where the motion shows it: all of it of a motion that distinguishes it from inertia, else the
  // mean torque, as if it were largest in the middle of the motion.
  std::optional<signal::Measured> weight;
  double phase = 0;       // p [rad], q at the joint's side
  bool reversed = false;  // it works against the motion; the values are those of its negative
};

struct SeenLoad {
  double motor_turns = 1;  // travel of motor_position over that of load_position; < 0: against each other
  double looseness = 0;    // rad, at the load: range of motor_position / motor_turns - load_position
  bool shows = true;       // more of it than the noise of the encoders: a gap, or teeth that yield
};

struct SeenJoint {
  record::RecordCheck check;
  double rate = 0, duration = 0;     // Hz, s
  double middle = 0, travel = 0;     // rad, of motor_position
  double fastest = 0;                // rad/s
  double acceleration = 0;           // rad/s^2, half of its range
  std::optional<SeenTorque> torque;  // absent: not recorded, or it stands still
  std::optional<SeenLoad> load;      // absent: no load_position that goes along

  const record::ChannelState* channel(record::Channel channel) const;
};

/// Share of the torque's variance that the motion must take for the effort to be a torque or a current at
/// all: choice, of joints whose weight and friction nobody declared 0.9 and more.
constexpr double kTakesTorque = 0.3;

/// Looks at a record that has been checked and mended. Throws BadData without motor_position, or where it is
/// shorter than 5 s or does not move.
SeenJoint look_at_joint(const record::CheckedRecord& checked);

/// A value at the motor's position under load: the torque of the weight that a motion holds is A sin(q + p).
struct Wave {
  double amplitude = 0, phase = 0;
};
/// The wave with these parts: sine * sin(q) + cosine * cos(q).
Wave wave_of(double sine, double cosine);

}  // namespace backlash::rig_draft
