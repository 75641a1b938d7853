// SPDX-License-Identifier: BSD-3-Clause
// A monitoring curve that can be written down: skewness falls linearly with backlash.
#pragma once

#include "backlash_diagnosis/diagnosis/monitoring_curve.h"

namespace backlash::test {

constexpr double kCurveStart = 4.5;     // skewness at backlash 0
constexpr double kCurveSlope = -15000;  // 1/m
constexpr double kCurveEnd = 2e-4;      // m
constexpr double kCurveBetween = 0.05, kCurveWithin = 0.1;
constexpr double kCurveToAngle = 67;  // rad/m

/// Conditions: a square wave of 0.05 N m at 10 Hz, sampled at 1 kHz.
inline diagnosis::MonitoringCurve linear_curve(int points = 21) {
  diagnosis::MonitoringCurve curve;
  diagnosis::CurveConditions& c = curve.conditions;
  c.rig = "linear";
  c.rig_digest = "0123456789abcdef";
  c.version = "0.1.0";
  c.signal = "sensor_torque";
  c.excitation = "square";
  c.amplitude = c.excitation_level = 0.05;
  c.frequency = 10;
  c.sampling_rate = 1000;
  c.apd = {60, -0.4, 0.4};
  c.periods = 10;
  c.settling_periods = 2;
  c.seeds = 8;
  c.motor_travel = 0.02;
  c.output_locked = true;
  curve.noise_levels = {0, 0.01};
  curve.backlash_to_angle = kCurveToAngle;
  for (int i = 0; i < points; ++i) {
    diagnosis::CurvePoint point;
    point.backlash = kCurveEnd * i / (points - 1);
    point.signal_level = 0.05;
    const diagnosis::SkewnessCell cell{kCurveStart + kCurveSlope * point.backlash, kCurveBetween,
                                       kCurveWithin};
    point.cells.assign(2, cell);
    curve.points.push_back(point);
  }
  return curve;
}

}  // namespace backlash::test
