// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/excitation.h"

#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "excitation/checks.h"

namespace backlash::simulation {
namespace {

const std::vector<std::string> kTypes = {"square",         "sine",       "chirp", "multi_sine",
                                         "random",         "constant",   "topic", "stepped_sine",
                                         "constant_speed", "sine_speed", "moves"};

void read_random(const YamlReader& yaml, ExcitationSettings& settings) {
  settings.amplitude = yaml.number("rms", Range::not_negative());
  settings.bias = yaml.number_or("bias", 0, Range::any());
  settings.start_frequency = yaml.number("lower_frequency", Range::positive());
  settings.end_frequency = yaml.number("upper_frequency", Range::positive());
  if (!(settings.end_frequency > settings.start_frequency))
    yaml.fail("upper_frequency", "must be > lower_frequency");
  settings.line_count = static_cast<int>(yaml.integer("lines", kFewestLines, kMostLines));
  settings.seed = static_cast<std::uint64_t>(yaml.integer("seed", 0, 1L << 53));
}

void read_multi_sine(const YamlReader& yaml, ExcitationSettings& settings) {
  settings.bias = yaml.number_or("bias", 0, Range::any());
  for (const YamlReader& line : yaml.maps("lines"))
    settings.lines.push_back({line.number("amplitude", Range::not_negative()),
                              line.number("frequency", Range::positive()),
                              line.number_or("phase", 0, Range::any())});
  if (settings.lines.empty()) yaml.fail("lines", "needs at least one line");
}

void read_waves(const YamlReader& yaml, ExcitationSettings& settings) {
  const std::string& type = settings.type;
  settings.amplitude = yaml.number("amplitude", Range::not_negative());
  settings.bias = yaml.number_or("bias", 0, Range::any());
  if (type == "square" || type == "sine") {
    settings.frequency = yaml.number("frequency", Range::positive());
    return;
  }
  settings.start_frequency = yaml.number("start_frequency", Range::positive());
  settings.end_frequency = yaml.number("end_frequency", Range::positive());
  if (type == "chirp") {
    settings.duration = yaml.number("duration", Range::positive());
    return;
  }
  if (settings.end_frequency < settings.start_frequency)
    yaml.fail("end_frequency", "must be >= start_frequency");
  settings.step_frequency = yaml.number("step_frequency", Range::positive());
  settings.cycles = static_cast<int>(yaml.integer("cycles", 1, 1'000'000));
}

MoveSettings read_moves(const YamlReader& yaml) {
  MoveSettings moves;
  moves.positions = yaml.numbers("positions", Range::any());
  if (moves.positions.size() < 2) yaml.fail("positions", "needs at least two positions");
  moves.speed = yaml.number("speed", Range::positive());
  moves.acceleration = yaml.number("acceleration", Range::positive());
  moves.dwell = yaml.number("dwell", Range::positive());
  moves.position_gain = yaml.number("position_gain", Range::positive());
  return moves;
}

void read_speed_loop(const YamlReader& yaml, ExcitationSettings& settings) {
  const YamlReader controller = yaml.map("controller");
  settings.controller.rate = controller.number("rate", Range::positive());
  settings.controller.proportional = controller.number("proportional", Range::not_negative());
  settings.controller.integral = controller.number("integral", Range::not_negative());
  settings.controller.torque_limit = controller.number("torque_limit", Range::positive());
  if (settings.type == "moves") {
    settings.moves = read_moves(yaml);
    return;
  }
  settings.ramp = yaml.number("ramp", Range::positive());
  if (settings.type == "sine_speed") {
    settings.bias = yaml.number("offset", Range::any());
    settings.amplitude = yaml.number("amplitude", Range::not_negative());
    settings.frequency = yaml.number("frequency", Range::positive());
  } else if (yaml.has("speeds")) {
    settings.speeds = yaml.numbers("speeds", Range::any());
    if (settings.speeds.empty()) yaml.fail("speeds", "needs at least one speed");
    settings.hold = yaml.number("hold", Range::positive());
  } else {
    settings.speeds = {yaml.number("speed", Range::any())};
    settings.hold = std::numeric_limits<double>::infinity();
  }
}

/// Where the torque acts, and whether the motor is held meanwhile.
void read_place(const YamlReader& yaml, ExcitationSettings& settings) {
  settings.at_load = yaml.has("at") && yaml.choice("at", {"motor", "load"}) == "load";
  settings.motor_brake = yaml.boolean_or("motor_brake", false);
  if (settings.at_load && settings.is_speed_loop()) yaml.fail("at", "a speed loop drives the motor");
  if (settings.motor_brake && !settings.at_load)
    yaml.fail("motor_brake", "needs at: load, no torque of the motor moves it against its brake");
}

}  // namespace

double Excitation::shortest_period(long) const {
  return std::numeric_limits<double>::infinity();
}

bool ExcitationSettings::is_speed_loop() const {
  return type == "constant_speed" || type == "sine_speed" || type == "moves";
}

std::unique_ptr<Excitation> ExcitationSettings::create() const {
  if (type == "square") return square_excitation(amplitude, frequency, bias);
  if (type == "sine") return sine_excitation(amplitude, frequency, bias);
  if (type == "chirp") return chirp_excitation(amplitude, start_frequency, end_frequency, duration, bias);
  if (type == "multi_sine") return multi_sine_excitation(lines, bias);
  if (type == "random")
    return random_excitation(amplitude, start_frequency, end_frequency, line_count, seed, bias);
  if (type == "constant") return constant_excitation(amplitude);
  if (type == "topic") return external_excitation();
  if (type == "stepped_sine")
    return stepped_sine_excitation(amplitude, start_frequency, end_frequency, step_frequency, cycles, bias);
  if (type == "constant_speed") return constant_speed_excitation(controller, speeds, hold, ramp);
  if (type == "sine_speed") return sine_speed_excitation(controller, bias, amplitude, frequency, ramp);
  if (type == "moves") return moves_excitation(controller, moves);
  if (type == "fourier") return fourier_excitation(controller, fourier, moves.position_gain);
  if (type.empty())
    throw InvalidParameter("excitation", "absent",
                           "a simulation needs it: give `excitation` in the rig file");
  throw InvalidParameter("excitation.type", type, "must be one of " + joined(kTypes));
}

ExcitationSettings read_excitation(const YamlReader& yaml) {
  ExcitationSettings settings;
  settings.type = yaml.choice("type", kTypes);
  const std::string& type = settings.type;
  if (type == "constant") settings.amplitude = yaml.number("torque", Range::any());
  if (type == "square" || type == "sine" || type == "chirp" || type == "stepped_sine")
    read_waves(yaml, settings);
  if (type == "random") read_random(yaml, settings);
  if (type == "multi_sine") read_multi_sine(yaml, settings);
  if (settings.is_speed_loop()) read_speed_loop(yaml, settings);
  read_place(yaml, settings);
  return settings;
}

}  // namespace backlash::simulation
