// SPDX-License-Identifier: BSD-3-Clause
// The priors of the declared machine: scales of length, time and position, and how well each value is known
// before a record is fitted.
#pragma once

#include <vector>

#include "backlash_diagnosis/fit/windowed_fit.h"
#include "waveform_windows.h"

namespace backlash::diagnosis {

/// Of the fit, in the order of waveform_quantities().
constexpr int kQuantityPlaces[] = {kMotorDamping,    kDryFriction,   kFrictionSpeed,    kSensorStiffness,
                                   kSensorDamping,   kMotorInertia,  kPinionInertia,    kGearInertia,
                                   kOutputStiffness, kOutputDamping, kContactStiffness, kContactLoss,
                                   kContactDamping,  kLinkInertia,   kLinkDamping,      kLinkFriction,
                                   kSensorGain,      kSensorLag,     kSensorTime};

/// The shared values of a fit: those of the motion, then the logarithm of a factor that each has to its
/// power in the symmetry of waveform.h. Values of parts that the machine does not have get the spread 0.
constexpr int kCommonScale = kGlobalValues, kSharedValues = kGlobalValues + 1;
struct WaveformPriors {
  fit::Priors shared;
  std::vector<double> powers;

  /// Spreads of a value that one of the common factor is.
  double common(int k) const;
  /// Value in its unit.
  double value(int k, const Eigen::Ref<const Eigen::VectorXd>& z) const;
};

constexpr double kForeignTorque = 0.07;  ///< of the level, typical of an effect that a rig file lacks: choice

/// m along the line of action, by which `level` [N m] twists the sensor.
double waveform_twist(const WaveformSettings& settings, double level);

/// s, cycle of the motor against the pinion.
double waveform_ring(const WaveformSettings& settings);

/// Under a torque of `level` [N m].
WaveformGrid waveform_grid(const WaveformSettings& settings, double level);

/// Half of the range, but for rare values; 1 without values.
double waveform_swing(const std::vector<double>& values);

/// rad, the same of the position. Of a free link, whose place drifts, within the windows.
double waveform_position_swing(const WaveformData& data, bool locked);

/// `lacking`: with what a rig file may lack, each as "nothing, give or take a typical share of the torque".
WaveformPriors waveform_priors(const WaveformSettings& settings, const WaveformData& data, bool lacking);

/// Smallest possible standard error of the logarithm of the gap from torque alone: by the symmetry of
/// waveform.h the torque does not determine the factor c, so that only the priors do. Theory.
double waveform_symmetry_error(const WaveformPriors& priors);

}  // namespace backlash::diagnosis
