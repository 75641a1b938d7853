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
constexpr double kGapStep = 3e-4;       // of the logarithm, about its standard error, of a difference
constexpr double kLeastStep = 1e-4;     // the same of values that are known better than a tenth
constexpr double kCurrentLoop = 3e-4;   // s, of a current loop
constexpr double kHysteresis = 0.05;    // steel teeth lose some per cent; no rig file has it
// What a rig file may lack. Spreads are what such machines have.
constexpr double kDragSpeed = 10;         // rad/s
constexpr double kForeignPinion = 0.02;   // of the level
constexpr double kForeignExponent = 0.1;  // Hertz's 1.5 against what measured teeth have, 1.1 to 1.6
constexpr double kForeignCurve = 0.01;    // of a strain gauge's gain from nothing to the level

double friction_spread(double declared, const WaveformData& data) {
  return std::isnan(declared) ? WaveformSpread::kDryFriction * data.level : declared;
}

/// What the machine has not is 0 and stays there.
void put(WaveformPriors& p, int k, double value, double spread, bool factor) {
  const bool has = !std::isnan(value);
  fit::Prior& prior = p.shared[std::size_t(k)];
  prior = {waveform_value_name(k), has ? value : 0, has ? spread : 0, has && factor};
  if (prior.factor && prior.spread > 0) prior.step = std::max(prior.step, kLeastStep / prior.spread);
}

void put_what_it_has(const WaveformSettings& s, const WaveformData& data, WaveformPriors& p) {
  put(p, kContactLoss, s.contact_loss, s.spread.contact_loss, true);
  put(p, kContactDamping, s.contact_damping, s.spread.contact_damping, true);
  put(p, kGearInertia, s.gear_inertia, s.spread.gear_inertia, true);
  put(p, kOutputStiffness, s.output_stiffness, s.spread.output_stiffness, true);
  put(p, kOutputDamping, s.output_damping, s.spread.output_damping, true);
  put(p, kLinkInertia, s.link_inertia, s.spread.link_inertia, true);
  put(p, kLinkDamping, s.link_damping, s.spread.link_damping, true);
  put(p, kLinkFriction, s.link_friction, friction_spread(s.spread.link_friction, data), false);
}

void put_what_it_lacks(const WaveformData& data, bool lacking, WaveformPriors& p) {
  const double times = lacking ? 1 : 0;
  put(p, kStribeck, 0, times * kForeignTorque * data.level, false);
  put(p, kLoadFriction, 0, times * kForeignTorque, false);
  put(p, kDrag, 0, times * kForeignTorque * data.level / (kDragSpeed * kDragSpeed), false);
  put(p, kPinionFriction, 0, times * kForeignPinion * data.level, false);
  put(p, kTeethExponent, 0, times * kForeignExponent, false);
  put(p, kSensorCurve, 0, times * kForeignCurve, false);
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

WaveformGrid waveform_grid(const WaveformSettings& s, double level) {
  double step = waveform_ring(s) / kStepsPerRing;
  if (s.contact_exponent < kHertzExponent) step = std::min(step, step_of_teeth(s, level));
  if (s.output != WaveformOutput::link) {
    const double per_link = s.output == WaveformOutput::locked ? 0 : 1 / s.link_inertia;
    step = std::min(
        step, kStepPerTime / std::sqrt(kStiffer * s.output_stiffness * (1 / s.gear_inertia + per_link)));
  }
  const double usual = std::pow(level / s.base_radius / s.contact_stiffness, 1 / s.contact_exponent);
  return {step, s.base_radius, level, usual, s.sensor_with_damper, s.output, s.contact_exponent};
}

double waveform_swing(const std::vector<double>& values) {
  return values.empty() ? 1 : signal::quantile_range(values, 0.001) / 2;
}

double waveform_position_swing(const WaveformData& data, bool locked) {
  if (locked || data.position.empty()) return waveform_swing(data.position);
  std::vector<double> all;
  for (const WaveformWindow& w : data.windows) {
    const auto first = data.position.begin() + static_cast<std::ptrdiff_t>(w.first);
    const auto [least, most] = std::minmax_element(first, first + static_cast<std::ptrdiff_t>(w.at.size()));
    all.push_back((*most - *least) / 2);
  }
  return signal::median(all);
}

double WaveformPriors::common(int k) const {
  const double spread = shared[std::size_t(k)].spread;
  return spread > 0 ? shared[kCommonScale].spread * powers[std::size_t(k)] / spread : 0;
}

double WaveformPriors::value(int k, const Eigen::Ref<const Eigen::VectorXd>& z) const {
  return shared[std::size_t(k)].value(z[k] + (k == kHalfGap ? 0 : common(k) * z[kCommonScale]));
}

WaveformPriors waveform_priors(const WaveformSettings& s, const WaveformData& data, bool lacking) {
  using Spread = WaveformSpread;
  const bool moves = s.output != WaveformOutput::locked, seen = !data.position.empty();
  WaveformPriors p{fit::Priors(kSharedValues), std::vector<double>(kSharedValues, 0)};
  put(p, kHalfGap, waveform_twist(s, data.level), kWideGap, true);
  p.shared[kHalfGap].step = kGapStep / kWideGap;
  put(p, kMotorDamping, s.motor_damping, s.spread.motor_damping, true);
  put(p, kDryFriction, s.dry_friction, friction_spread(s.spread.dry_friction, data), false);
  put(p, kFrictionSpeed, s.friction_speed, s.spread.friction_speed, true);
  put(p, kSensorStiffness, s.sensor_stiffness, s.spread.sensor_stiffness, true);
  put(p, kSensorDamping, s.sensor_damping, s.spread.sensor_damping, true);
  put(p, kMotorInertia, s.motor_inertia, s.spread.motor_inertia, true);
  put(p, kPinionInertia, s.pinion_inertia, s.spread.pinion_inertia, true);
  put_what_it_has(s, data, p);
  put(p, kContactStiffness, s.contact_stiffness, s.spread.contact_stiffness, true);
  put(p, kSensorGain, s.sensor_gain, s.spread.sensor_gain, true);
  put(p, kSensorBias, 0, Spread::kBias * data.level, false);
  put(p, kSensorLag, s.sensor_delay, s.spread.sensor_delay, false);
  put(p, kSensorTime, s.sensor_time_constant, s.spread.sensor_time_constant, false);
  put(p, kSwitchDelay, 0, data.square ? std::hypot(data.interval / 2, kCurrentLoop) : data.interval / 2,
      false);
  put(p, kSwitchTime, 0, data.square ? kCurrentLoop : 0, false);
  put(p, kDriveOffset, 0, Spread::kDrive * data.level, false);
  put(p, kDriveSlope, 0, moves ? 0 : Spread::kDriveSlope * data.level, false);
  put(p, kPositionZero, seen && !moves ? signal::median(data.position) : 0,
      seen && !moves ? waveform_swing(data.position) : 0, false);
  put(p, kTeethHysteresis, 0, lacking || !seen ? kHysteresis : 0, false);
  put_what_it_lacks(data, lacking, p);
  p.shared[kCommonScale] = {"common scale", 1, s.common_scale, true};
  p.powers[kHalfGap] = -1;
  for (std::size_t i = 0; i < waveform_quantities().size(); ++i)
    p.powers[static_cast<std::size_t>(kQuantityPlaces[i])] = scale_power(waveform_quantities()[i], s);
  return p;
}

double waveform_symmetry_error(const WaveformPriors& priors) {
  double information = 0;
  for (int k = 0; k < kGlobalValues; ++k)
    if (const double spread = priors.shared[std::size_t(k)].spread; spread > 0)
      information += std::pow(priors.powers[std::size_t(k)] / spread, 2);
  return std::hypot(1 / std::sqrt(information), priors.shared[kCommonScale].spread);
}

}  // namespace backlash::diagnosis
