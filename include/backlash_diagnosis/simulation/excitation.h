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

namespace backlash {

class Excitation {
 public:
  virtual ~Excitation() = default;

  /// Torque [N m] at time t [s] by the formula of a segment.
  virtual double torque(double t, long segment) const = 0;

  /// End of a segment [s]; infinite where the torque never jumps again.
  virtual double segment_end(long segment) const = 0;

  /// Called at the start of each segment, before its torque is asked for, with what can be seen of the
  /// machine: where a closed loop decides.
  virtual void begin_segment(long /*segment*/, const Observation& /*machine*/) {}

  /// Time [s] within which the torque may rise and fall again; infinite where it is constant in a segment.
  virtual double shortest_period() const;

  /// Repetition time [s]; 0 where the torque does not repeat.
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

/// What a rig file says under `excitation`; a recipe, so that copies of it can run side by side.
struct ExcitationSettings {
  std::string type = "square";  // square, sine, chirp, multi_sine, random, constant, topic
  double amplitude = 0;         // N m; the torque itself for `constant`, its rms for `random`
  double frequency = 0;         // Hz, square and sine
  double bias = 0;              // N m
  double start_frequency = 0, end_frequency = 0, duration = 0;  // Hz, Hz, s: chirp
  std::vector<SineLine> lines;                                  // multi_sine
  int line_count = 0;        // random, with start_ and end_frequency as the band
  std::uint64_t seed = 0;    // random
  bool at_load = false;      // the torque acts on the load, not on the motor
  bool motor_brake = false;  // the motor is held

  std::unique_ptr<Excitation> create() const;
};

ExcitationSettings read_excitation(const YamlReader& yaml);

}  // namespace backlash
