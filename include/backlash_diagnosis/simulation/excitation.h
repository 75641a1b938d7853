// SPDX-License-Identifier: BSD-3-Clause
// Motor torque as a function of time, smooth between switching times that are known exactly.
//
// Time is cut into segments 0, 1, 2, ... at the switching times. Inside a segment the torque is a smooth
// function; at a switching time both neighbours are defined, so an integrator that stops there never sees the
// wrong side of a jump.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/simulation/fourier_motion.h"

namespace backlash::simulation {

class Excitation {
 public:
  virtual ~Excitation() = default;

  /// Torque [N m] at time t [s] by the formula of a segment.
  virtual double torque(double t, long segment) const = 0;

  /// End of a segment [s]; infinite where the torque never jumps again.
  virtual double segment_end(long segment) const = 0;

  /// Called at the start of each segment, before its torque is needed, with what can be seen of the machine.
  /// A closed loop decides here.
  virtual void begin_segment(long /*segment*/, const model::Observation& /*machine*/) {}

  /// Time [s] within which the torque may rise and fall again inside a segment; infinite where it does not.
  virtual double shortest_period(long segment) const;

  /// Repetition time [s]; 0 where the torque does not repeat (that of a closed loop does so only nearly).
  virtual double period() const { return 0; }

  /// Torque set from outside [N m], held until the next call. Refused (false) by all but the `topic`
  /// excitation. Throws InvalidParameter for a torque that is not finite.
  virtual bool set_torque(double) { return false; }
};

/// One line of a multi-sine.
struct SineLine {
  double amplitude;  // N m
  double frequency;  // Hz
  double phase;      // rad
};

/// All of them throw InvalidParameter for a value that is not finite or a frequency or duration that is not >
/// 0.
std::unique_ptr<Excitation> constant_excitation(double torque);
/// +amplitude for the first half of each period, -amplitude for the second, plus bias.
std::unique_ptr<Excitation> square_excitation(double amplitude, double frequency, double bias = 0);
std::unique_ptr<Excitation> sine_excitation(double amplitude, double frequency, double bias = 0);
/// Sine whose frequency rises linearly from `start` to `end` [Hz] within `duration` [s], then starts again.
std::unique_ptr<Excitation> chirp_excitation(double amplitude, double start, double end, double duration,
                                             double bias = 0);
/// Sum of sines; its period is the inverse of the greatest common divisor of the frequencies (to 1e-6 Hz), 0
/// where that is below 1 mHz.
std::unique_ptr<Excitation> multi_sine_excitation(std::vector<SineLine> lines, double bias = 0);
/// Random torque of the given rms [N m] in a band [Hz], as a sum of `lines` (>= 16) sines of equal amplitude:
/// one per equal part of the band, at a frequency and with a phase drawn from `seed`. Nearly Gaussian; never
/// repeats.
std::unique_ptr<Excitation> random_excitation(double rms, double lower, double upper, int lines,
                                              std::uint64_t seed, double bias = 0);
/// Zero until set_torque() is called.
std::unique_ptr<Excitation> external_excitation();

/// Sine whose frequency goes from `start` to at most `end` [Hz] in steps of `step` [Hz], `cycles` whole
/// cycles at each and continuous throughout, then starts again: a sine sweep as in Yumrukcal (2013, Chapter
/// 3).
std::unique_ptr<Excitation> stepped_sine_excitation(double amplitude, double start, double end, double step,
                                                    int cycles, double bias = 0);

/// PI controller of the motor's speed, in the units of motor_torque and motor_velocity:
///   torque = P e + I sum(e) / rate,  e = reference - speed,  limited; held until its next sample
/// The sum stands still while the limit acts (no wind-up). It is given the exact speed, not a sensor's.
struct SpeedController {
  double rate = 0;          // Hz
  double proportional = 0;  // P, N m s/rad
  double integral = 0;      // I, N m/rad
  double torque_limit = 0;  // N m
};

/// One speed [rad/s] after the other, each held for `hold` [s] (infinite: the first for ever) after a smooth
/// ramp of `ramp` [s] from the one before, the first from rest; then again from the first.
std::unique_ptr<Excitation> constant_speed_excitation(const SpeedController& controller,
                                                      std::vector<double> speeds, double hold, double ramp);
/// Speed offset + amplitude sin(2 pi f t) [rad/s], faded in smoothly within `ramp` [s].
std::unique_ptr<Excitation> sine_speed_excitation(const SpeedController& controller, double offset,
                                                  double amplitude, double frequency, double ramp);

/// A task of moves from position to position, as a robot's controller makes them: the speed that the
/// controller is asked for is
///   v(t) + G (q(t) - position)
/// q, v: a trapezoid of the speed. After the last position comes the first again. Given the exact position.
struct MoveSettings {
  std::vector<double> positions;  // rad, of the motor as motor_position counts it; at least two
  double speed = 0;               // rad/s, the largest
  double acceleration = 0;        // rad/s^2, the largest
  double dwell = 0;               // s, at each position
  double position_gain = 0;       // G, 1/s
};
std::unique_ptr<Excitation> moves_excitation(const SpeedController& controller, const MoveSettings& moves);

/// The same loop along a planned motion.
std::unique_ptr<Excitation> fourier_excitation(const SpeedController& controller, const FourierMotion& motion,
                                               double position_gain);

/// What a rig file says under `excitation`; a recipe, so that copies of it can run side by side.
struct ExcitationSettings {
  // square, sine, chirp, multi_sine, random, constant, topic, stepped_sine, constant_speed, sine_speed,
  // moves; fourier, which no rig file has: a motion that was planned for `moves`
  std::string type = "square";
  double amplitude =
      0;  // N m; the torque itself for `constant`, its rms for `random`; rad/s for `sine_speed`
  double frequency = 0;  // Hz, square, sine and sine_speed
  double bias = 0;       // N m; rad/s, the offset of `sine_speed`
  double start_frequency = 0, end_frequency = 0,
         duration = 0;          // Hz, Hz, s: chirp, the first two stepped_sine
  double step_frequency = 0;    // Hz, stepped_sine
  int cycles = 0;               // per frequency, stepped_sine
  std::vector<SineLine> lines;  // multi_sine
  int line_count = 0;           // random, with start_ and end_frequency as the band
  std::uint64_t seed = 0;       // random
  SpeedController controller;   // constant_speed, sine_speed and moves
  MoveSettings moves;
  FourierMotion fourier;       // with the controller and the position_gain of moves
  std::vector<double> speeds;  // rad/s, constant_speed
  double hold = 0, ramp = 0;   // s, constant_speed; sine_speed has a ramp
  bool at_load = false;        // the torque acts on the load, not on the motor
  bool motor_brake = false;    // the motor is held

  bool is_speed_loop() const;
  std::unique_ptr<Excitation> create() const;
};

ExcitationSettings read_excitation(const YamlReader& yaml);

}  // namespace backlash::simulation
