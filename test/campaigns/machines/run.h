// SPDX-License-Identifier: BSD-3-Clause
// A run of a machine under speed control, and what its sensors write down.
#pragma once

#include <string>
#include <vector>

#include "machine.h"
#include "random.h"

namespace machines {

struct Tone {
  double amplitude = 0, frequency = 0, phase = 0;  // Hz, rad
  bool square = false;
  double value(double time) const;
};

/// What the drive is asked for: a speed [rad/s], and a torque on top [N m].
struct Reference {
  std::vector<Tone> speed, torque;
};

/// The kinds of motion of the records in undeclared/: `steps` (training: two slow sines and a square wave of
/// 1.3 Hz), `sines` (two slow sines and one of 1.9 Hz) and `reversals` (a square wave of 0.15 Hz that drives
/// the torque to its limit, and 0.9 Hz), all with a torque of 7 and 17 Hz. Without dither only the slow parts
/// remain.
Reference draw_reference(const std::string& kind, bool dither, Random& random);

struct Travel {
  double from = 0, to = 0;  // rad
};
Travel travel_of(const Reference& reference, double duration);

struct Row {
  double torque, motor_position, load_position;
};

/// Rows at 0, interval, ... below duration, from rest at 0, before noise and quantisation: the torque that
/// acts from the row's time on, held to the next, and both angles as the sensors see them.
std::vector<Row> run(const Machine& machine, const Reference& reference, double duration, double interval);

/// Adds noise, rounds to what the encoders resolve.
void measure(const Sensors& sensors, double interval, Random& random, std::vector<Row>& rows);

void write_csv(const std::vector<Row>& rows, double interval, const std::string& path);

}  // namespace machines
