// SPDX-License-Identifier: BSD-3-Clause
#include "run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "plant.h"

namespace machines {
namespace {

constexpr double kStep = 2e-5;         // s: a period of the mesh has a thousand
constexpr double kTravelStep = 1e-3;   // s
constexpr double kSlowestLoop = 1e-3;  // s; records may be slower

/// PI control of the motor's speed; gain and limit as the records in undeclared/ show them.
class SpeedControl {
 public:
  SpeedControl(double interval, double gain) : interval_(interval), gain_(gain * kGain) {}

  double torque(double wanted, double speed, double extra) {
    const double error = wanted - speed;
    const double torque = gain_ * error + integral_ + extra;
    if (std::abs(torque) < kLimit) integral_ += gain_ / kIntegralTime * error * interval_;
    return std::clamp(torque, -kLimit, kLimit);
  }

 private:
  static constexpr double kGain = 4800;         // N m s/rad
  static constexpr double kIntegralTime = 0.3;  // s
  static constexpr double kLimit = 2440;        // N m
  double interval_, gain_, integral_ = 0;
};

double sum(const std::vector<Tone>& tones, double time) {
  double total = 0;
  for (const Tone& tone : tones) total += tone.value(time);
  return total;
}

}  // namespace

double Tone::value(double time) const {
  const double wave = std::sin(2 * Random::kPi * frequency * time + phase);
  return amplitude * (square ? std::copysign(1.0, wave) : wave);
}

Reference draw_reference(const std::string& kind, bool dither, Random& random) {
  const auto tone = [&random](double amplitude, double frequency, bool square = false) {
    const double size = random.uniform(0.93, 1.07), pace = random.uniform(0.93, 1.07);
    return Tone{amplitude * size, frequency * pace, random.phase(), square};
  };
  Reference reference;
  Tone faster;
  if (kind == "steps") {
    reference.speed = {tone(0.56, 0.1125), tone(0.224, 0.469)};
    faster = tone(0.105, 1.3, true);
  } else if (kind == "sines") {
    reference.speed = {tone(0.306, 0.07), tone(0.304, 0.23)};
    faster = tone(0.125, 1.9);
  } else if (kind == "reversals") {
    reference.speed = {tone(0.46, 0.15, true)};
    faster = tone(0.158, 0.9);
  } else {
    throw std::invalid_argument("no such motion: " + kind);
  }
  if (dither) {
    reference.speed.push_back(faster);
    reference.torque = {tone(22, 7), tone(9, 17)};
  }
  return reference;
}

Travel travel_of(const Reference& reference, double duration) {
  Travel travel;
  double position = 0;
  for (double time = 0; time < duration; time += kTravelStep) {
    position += sum(reference.speed, time) * kTravelStep;
    travel.from = std::min(travel.from, position);
    travel.to = std::max(travel.to, position);
  }
  return travel;
}

std::vector<Row> run(const Machine& machine, const Reference& reference, double duration, double interval) {
  const auto samples = static_cast<std::size_t>(std::lround(duration / interval));
  const auto loops = static_cast<std::size_t>(std::ceil(interval / kSlowestLoop - 1e-9));  // per sample
  const double loop = interval / static_cast<double>(loops);
  const auto per_loop = static_cast<std::size_t>(std::lround(loop / kStep));
  const std::size_t per_sample = loops * per_loop;
  const auto steps = [](double time) { return static_cast<std::size_t>(std::lround(time / kStep)); };
  const std::size_t late = steps(machine.sensors.latency),
                    load_late = late + steps(machine.sensors.load_skew);
  std::vector<Row> rows(samples);
  const auto shown = [&](std::size_t step) {  // none between two samples
    return step % per_sample == 0 && step / per_sample < samples ? &rows[step / per_sample] : nullptr;
  };
  Plant plant(machine);
  SpeedControl control(loop, machine.drive.gain);
  for (std::size_t k = 0; k < samples * loops; ++k) {
    const double time = static_cast<double>(k) * loop;
    const double torque =
        control.torque(sum(reference.speed, time), plant.motor_speed(), sum(reference.torque, time));
    if (k % loops == 0) rows[k / loops].torque = torque;
    for (std::size_t step = k * per_loop; step < (k + 1) * per_loop; ++step) {
      if (Row* row = shown(step + late)) row->motor_position = plant.motor_position();
      if (Row* row = shown(step + load_late))
        row->load_position = plant.load_position() * machine.sensors.load_gain;
      plant.step(torque, kStep);
    }
  }
  return rows;  // before `late` angles are 0, where the machine starts from rest
}

void measure(const Sensors& sensors, double interval, Random& random, std::vector<Row>& rows) {
  const double memory =
      sensors.noise_corner > 0 ? std::exp(-2 * Random::kPi * sensors.noise_corner * interval) : 0;
  double noise = random.normal();
  for (Row& row : rows) {
    row.torque += sensors.torque_noise * noise;
    noise = memory * noise + std::sqrt(1 - memory * memory) * random.normal();
    row.motor_position = std::round(row.motor_position / sensors.motor_resolution) * sensors.motor_resolution;
    row.load_position = std::round(row.load_position / sensors.load_resolution) * sensors.load_resolution;
  }
}

void write_csv(const std::vector<Row>& rows, double interval, const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (file == nullptr) throw std::runtime_error("cannot write " + path);
  std::fputs("time,motor_torque,motor_position,load_position\n", file);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    std::fprintf(file, "%.4f,%.4f,%.9f,%.9f\n", static_cast<double>(k) * interval, rows[k].torque,
                 rows[k].motor_position, rows[k].load_position);
  }
  if (std::fclose(file) != 0) throw std::runtime_error("cannot write " + path);
}

}  // namespace machines
