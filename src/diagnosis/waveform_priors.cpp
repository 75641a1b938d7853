// SPDX-License-Identifier: BSD-3-Clause
#include "waveform_priors.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::diagnosis {
namespace {

// All choices, tried on simulated machines, but where another origin is given.
constexpr double kStepsPerRing = 155;   // of the integration
constexpr double kStepPerTime = 1;      // step times fastest frequency: Runge and Kutta's is stable to 2.8
constexpr double kStepPerImpact = 0.3;  // step times frequency of the teeth
constexpr double kImpact = 3;           // times the level, torque of an impact
constexpr double kStiffer = 3;          // output and contact may be so much stiffer than declared
constexpr double kWideGap = 3;          // spread of the logarithm of the gap: next to nothing is known

double friction_spread(double declared, const WaveformData& data) {
  return std::isnan(declared) ? WaveformSpread::kDryFriction * data.level : declared;
}

/// Powers in the factor of the symmetry. Theory.
void put_powers(const WaveformSettings& s, WaveformPriors& p) {
  p[kHalfGap].power = -1;
  for (std::size_t i = 0; i < waveform_quantities().size(); ++i)
    p[static_cast<std::size_t>(kQuantityPlaces[i])].power = scale_power(waveform_quantities()[i], s);
}

/// Of contact and output: what the machine has not is 0 and stays there.
void put_what_it_has(const WaveformSettings& s, const WaveformData& data, WaveformPriors& p) {
  const auto put = [&p](int k, double value, double spread, bool factor) {
    const bool has = !std::isnan(value);
    p[static_cast<std::size_t>(k)] = {has ? value : 0, has ? spread : 1, has && factor, has};
  };
  put(kContactLoss, s.contact_loss, s.spread.contact_loss, true);
  put(kContactDamping, s.contact_damping, s.spread.contact_damping, true);
  put(kGearInertia, s.gear_inertia, s.spread.gear_inertia, true);
  put(kOutputStiffness, s.output_stiffness, s.spread.output_stiffness, true);
  put(kOutputDamping, s.output_damping, s.spread.output_damping, true);
  put(kLinkInertia, s.link_inertia, s.spread.link_inertia, true);
  put(kLinkDamping, s.link_damping, s.spread.link_damping, true);
  put(kLinkFriction, s.link_friction, friction_spread(s.spread.link_friction, data), false);
}

}  // namespace

double waveform_twist(const WaveformSettings& s, double level) {
  return s.base_radius * level / s.sensor_stiffness;
}

double waveform_ring(const WaveformSettings& s) {
  return 2 * M_PI / std::sqrt(s.sensor_stiffness * (1 / s.motor_inertia + 1 / s.pinion_inertia));
}

/// s. Hertzian teeth under small torques are softer than the output.
double step_of_teeth(const WaveformSettings& s, double level) {
  const double n = s.contact_exponent, force = kImpact * level / s.base_radius;
  const double stiffness = n * std::pow(kStiffer * s.contact_stiffness, 1 / n) * std::pow(force, 1 - 1 / n);
  const double gear = std::isnan(s.gear_inertia) ? s.link_inertia : s.gear_inertia;
  return kStepPerImpact / (s.base_radius * std::sqrt(stiffness * (1 / s.pinion_inertia + 1 / gear)));
}

WaveformGrid waveform_grid(const WaveformSettings& s, double interval, double level) {
  double step = waveform_ring(s) / kStepsPerRing;
  if (s.contact_exponent < kHertzExponent) step = std::min(step, step_of_teeth(s, level));
  if (s.output != WaveformOutput::link) {
    const double per_link = s.output == WaveformOutput::locked ? 0 : 1 / s.link_inertia;
    step = std::min(
        step, kStepPerTime / std::sqrt(kStiffer * s.output_stiffness * (1 / s.gear_inertia + per_link)));
  }
  return {interval,      static_cast<int>(std::ceil(interval / step - 1e-6)),
          s.base_radius, s.sensor_with_damper,
          s.output,      s.contact_exponent};
}

double waveform_swing(const std::vector<double>& values) {
  return values.empty() ? 1 : signal::quantile_range(values, 0.001) / 2;
}

double waveform_position_swing(const WaveformData& data) {
  if (data.grid.output == WaveformOutput::locked || data.position.empty())
    return waveform_swing(data.position);
  std::vector<double> all;
  for (const WaveformWindow& w : data.windows) {
    const auto first = data.position.begin() + w.first;
    const auto [least, most] = std::minmax_element(first, first + w.samples);
    all.push_back((*most - *least) / 2);
  }
  return signal::median(all);
}

WaveformPriors waveform_priors(const WaveformSettings& s, const WaveformData& data) {
  using Spread = WaveformSpread;
  const bool moves = s.output != WaveformOutput::locked;
  const double position = data.position.empty() ? 1 : waveform_swing(data.position);
  const double middle = data.position.empty() ? 0 : signal::median(data.position);
  WaveformPriors p;
  p[kHalfGap] = {waveform_twist(s, data.level), kWideGap, true};
  p[kMotorDamping] = {s.motor_damping, s.spread.motor_damping, true};
  p[kDryFriction] = {s.dry_friction, friction_spread(s.spread.dry_friction, data)};
  p[kFrictionSpeed] = {s.friction_speed, s.spread.friction_speed, true};
  p[kSensorStiffness] = {s.sensor_stiffness, s.spread.sensor_stiffness, true};
  p[kSensorDamping] = {s.sensor_damping, s.spread.sensor_damping, true};
  p[kMotorInertia] = {s.motor_inertia, s.spread.motor_inertia, true};
  p[kPinionInertia] = {s.pinion_inertia, s.spread.pinion_inertia, true};
  put_what_it_has(s, data, p);
  p[kContactStiffness] = {s.contact_stiffness, s.spread.contact_stiffness, true};
  p[kSensorGain] = {s.sensor_gain, s.spread.sensor_gain, true};
  p[kSensorBias] = {0, Spread::kBias * data.level};
  p[kSensorLag] = {s.sensor_delay, s.spread.sensor_delay};
  p[kSensorTime] = {s.sensor_time_constant, s.spread.sensor_time_constant};
  p[kSwitchDelay] = {0, data.grid.interval / 2};  // theory: it is seen a sample late at most
  p[kDriveOffset] = {0, Spread::kDrive * data.level};
  p[kDriveSlope] = {0, Spread::kDriveSlope * s.sensor_stiffness, false, !moves};
  p[kPositionZero] = {moves ? 0 : middle, position, false, !moves && !data.position.empty()};
  put_powers(s, p);
  return p;
}

double waveform_symmetry_error(const WaveformPriors& priors, double common) {
  Eigen::VectorXd w = Eigen::VectorXd::Zero(kGlobalValues);
  for (int k = 0; k < kGlobalValues; ++k) {
    const WaveformPrior& prior = priors[static_cast<std::size_t>(k)];
    w[k] = prior.power / prior.spread;
  }
  return 1 / std::sqrt(w.dot(waveform_precision(priors, common) * w));
}

}  // namespace backlash::diagnosis
