// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/fit/noise_floor.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/mesh_resonance.h"
#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/spectrum.h"
#include "backlash_diagnosis/simulation/driven_load.h"

namespace backlash::identification {
namespace {

using Complex = std::complex<double>;

/// Gain of low_pass() (zero_phase.h).
double low_pass_gain(double frequency, double cutoff, double interval) {
  return 1 / (1 + std::pow(std::tan(M_PI * frequency * interval) / std::tan(M_PI * cutoff * interval), 8));
}

/// Not more than the median of fourth differences gives: the spectrum ends in noise where a signal is sampled
/// fast; where it is not, the motion after a reversal reaches to its end, which that median hardly feels.
double by_median(const std::vector<double>& values, double spectral) {
  const double median = signal::noise_from_differences(values, 4);
  return median > 0 ? std::min(spectral, median) : spectral;
}

double noise_deviation(const std::vector<double>& position) {
  const double step = signal::resolution(position);
  return step > 0 ? std::max(step / std::sqrt(12.0), by_median(position, signal::white_noise(position)))
                  : by_median(position, signal::position_noise(position));
}

/// Variance per line of the load position's noise at (i + 1/2) / (2 lines interval): white beyond the
/// resolution, and the rounding of this motion.
std::vector<double> load_noise(const RecordNoise& record, const std::vector<double>& load) {
  const double step = record.load_step, noise = record.load;
  std::size_t size = 2;
  while (size < load.size()) size *= 2;
  const double white = std::max(0.0, noise * noise - step * step / 12);
  std::vector<double> power(size / 2, white / (0.5 * double(size)));
  if (step == 0) return power;
  std::vector<double> error(size, 0.0);
  double mean = 0;
  for (std::size_t k = 0; k < load.size(); ++k) {
    error[k] = step * std::round(load[k] / step) - load[k];
    mean += error[k] / double(load.size());
  }
  for (std::size_t k = 0; k < load.size(); ++k) error[k] -= mean;
  const std::vector<Complex> lines = signal::fourier_transform(error);
  for (std::size_t i = 0; i < power.size(); ++i)
    power[i] += 2 * std::norm(lines[i + 1]) / (double(size) * double(load.size()));
  return power;
}

struct Spring {
  double stiffness = 0, damping = 0;  // N m/rad, N m s/rad
};

/// Of the teeth under the usual torque of a record, about which noise moves them.
Spring mesh_spring(const model::Rig& rig, const std::vector<double>& torque) {
  if (rig.mesh.rigid || !rig.mesh.contact->power_contact()) return {};
  const model::PowerContact law = *rig.mesh.contact->power_contact();
  const double lever = rig.mesh.lever(),
               depth = rig.mesh.contact->static_penetration(model::usual_torque(torque) / lever);
  const double force = law.stiffness * std::pow(depth, law.exponent);
  const double stiffness = law.exponent == 1 ? law.stiffness : law.exponent * force / depth;
  return {stiffness * lever * lever, (law.damping + law.loss * force) * lever * lever};
}

}  // namespace

namespace {

/// Without what lies between the grid of an encoder.
std::vector<double> recorded(const std::vector<double>& x, const std::vector<bool>& lost) {
  std::vector<double> kept;
  for (std::size_t k = 0; k < x.size(); ++k)
    if (lost.empty() || !lost[k]) kept.push_back(x[k]);
  return kept;
}

}  // namespace

RecordNoise record_noise(const ServoData& data) {
  RecordNoise noise;
  noise.motor = noise_deviation(data.motor);
  noise.torque = by_median(data.torque, signal::white_noise(data.torque));
  if (data.load.empty()) return noise;
  noise.load = noise_deviation(data.load);
  noise.load_step = signal::resolution(recorded(data.load, data.lost));
  return noise;
}

NoiseFloors noise_floors(const model::Rig& rig, const ServoData& data, const RecordNoise& noise,
                         const std::vector<double>& load, double cutoff, double feedback) {
  const model::GearTrain train(rig);
  const bool free = simulation::load_moves_freely(rig);
  const double motor_inertia = train.motor_inertia(), load_inertia = train.load_inertia();
  const auto [k, b] = mesh_spring(rig, data.torque);
  const double rate_cutoff = data.load_rate_cutoff;
  const std::vector<double> load_power =
      free ? load_noise(noise, load) : std::vector<double>(data.size() / 2, 0.0);
  const double lines = double(load_power.size());
  const double motor_power = std::pow(noise.motor, 2) / lines,
               torque_power = std::pow(noise.torque, 2) / lines;
  double torque = 0, deflection = 0;
  for (std::size_t i = 0; i < load_power.size(); ++i) {
    const double f = 0.5 * (double(i) + 0.5) / (lines * data.interval);
    const double gain = low_pass_gain(f, cutoff, data.interval), power = gain * gain;
    const Complex s(0, 2 * M_PI * f), z = rig.mesh.rigid ? Complex(0) : k + b * s;
    if (!free) {
      torque += power * (torque_power + motor_power * std::norm(motor_inertia * s * s + z));
      continue;
    }
    const Complex drawn = load_inertia * feedback * s;
    const Complex d = load_inertia * s * s + drawn + z;
    const Complex drawn_by = drawn * low_pass_gain(f, rate_cutoff, data.interval) / d;
    torque += power * (torque_power + motor_power * std::norm(motor_inertia * s * s + z * (1.0 - z / d)) +
                       load_power[i] * std::norm(z * drawn_by));
    deflection += power * (motor_power * std::norm(z / d) + load_power[i] * std::norm(1.0 - drawn_by));
  }
  return {std::sqrt(torque), std::sqrt(deflection)};
}

}  // namespace backlash::identification
