// SPDX-License-Identifier: BSD-3-Clause
// How a gear train with a torque sensor moves about one reversal of its torque, for several sets of values at
// once:
//
//   Jm qm'' = tau + offset + slope qm - cm qm' - dry sat(qm' / friction_speed) - T     sat(x): x within +-1
//   Jp qp'' = T - F rb                       T = Ki (qm - qp) + Ci (qm' - qp')
//   Jg qg'' = F rb - Ko qg - Co qg'          F = K d^1.5 max(0, 1 + 3/2 alpha d' + h d' / (|d'| + 1 mm/s)),
//   d = |rb (qp - qg)| - gap
//
// with a free link instead of the locked output as in waveform.h. Effects that a rig file may lack are added
// (theory of each: model/terms): motor friction that falls with speed and grows with T, quadratic drag, dry
// friction of the pinion, teeth of another exponent,
//
//   dry -> max(0, dry + s exp(-(qm' / (3 friction_speed))^2) + l |T|),  cm -> cm + q |qm'|
//   F -> F (d / d0)^e
//
// with d0 the penetration under the usual torque.
//
// F has the sign of qp - qg (Hunt and Crossley 1975; Sarkar, Ellis and Moore 1997, Eqs. 8 to 12). `offset`
// and `slope` stand for cogging and gravity within the small travel. A square wave turns with a first-order
// lag. The sensors:
//
//   torque = gain S (1 + curve |S| / level) + bias, S = Ki (qm - qp) a first-order lag and a delay later
//   position = qm + zero
//
// A free link has no place of its own: each window has its zero, and the gear is at 0 when it starts.
//
// The classical Runge-Kutta method with a fixed step: every set of values makes the same steps, so that
// differences between sets are smooth.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "backlash_diagnosis/diagnosis/waveform.h"

namespace backlash::diagnosis {

/// Values of the machine, of its sensors, then of the start of one window.
enum WaveformValue {
  kHalfGap,           // m, half of the backlash
  kMotorDamping,      // cm, N m s/rad
  kDryFriction,       // N m, < 0 counts as 0
  kFrictionSpeed,     // rad/s, > 0
  kSensorStiffness,   // Ki, N m/rad
  kSensorDamping,     // Ci, N m s/rad
  kMotorInertia,      // Jm, kg m^2
  kPinionInertia,     // Jp
  kGearInertia,       // Jg
  kOutputStiffness,   // Ko, N m/rad
  kOutputDamping,     // Co, N m s/rad
  kContactStiffness,  // K, N/m^n
  kContactLoss,       // alpha, s/m
  kContactDamping,    // c, N s/m
  kLinkInertia,       // Jl, kg m^2
  kLinkDamping,       // cl, N m s/rad
  kLinkFriction,      // N m, < 0 counts as 0
  kSensorGain,        // -
  kSensorBias,        // N m
  kSensorLag,         // s
  kSensorTime,        // s, time constant of a first-order lag besides, < 0 counts as 0
  kSwitchDelay,       // s, by which the torque switches later than the window says
  kSwitchTime,        // s, time constant of a square wave, < 0 counts as 0
  kDriveOffset,       // N m
  kDriveSlope,        // N m/rad
  kPositionZero,      // rad
  kTeethHysteresis,   // h, -
  // What a rig file may lack.
  kStribeck,        // s, N m
  kLoadFriction,    // l, -
  kDrag,            // q, N m s^2/rad^2
  kPinionFriction,  // N m, < 0 counts as 0
  kTeethExponent,   // e, -
  kSensorCurve,     // -
  kGlobalValues,
  kStartTwist = kGlobalValues,  // N m: Ki (qm - qp), towards the flank that is loaded
  kStartFlank,                  // N m: torque on that flank; < 0: off it by -kStartFlank / Ki
  kStartTwistRate,              // N m per ms: Ki (qm' - qp')
  kStartPinionRate,             // N m per ms: Ki qp'
  kStartGearRate,               // N m per ms: Ki (qg' - qp'), of a free link
  kStartZero,                   // rad: of the position, of a free link
  kStartSwitch,                 // s, by which the torque switches later in this window
  kAllValues,
  kStartValues = kAllValues - kGlobalValues
};

constexpr double kHertzExponent = 1.5;      // exponent of the contact that takes the least time
constexpr double kWaveformRateTime = 1e-3;  // s, of the start values that are rates: choice
constexpr int kWaveformSets = 8;  // moved at once: two registers of AVX2, so that their waits overlap
/// Name of a value for messages.
const char* waveform_value_name(int which);
using WaveformSets = std::array<std::array<double, kWaveformSets>, kAllValues>;

/// A stretch of samples about one reversal, which starts at the first of them.
struct WaveformWindow {
  double side = 1;               // sign of the torque before the reversal
  double before = 0, after = 0;  // N m, torque of the motor
  double reversal = 0;           // s after the first sample
  double unsure = 0;             // s, standard deviation of that
  std::size_t first = 0;         // sample of the record
  std::vector<double> at;        // s, of each sample after the first
  std::vector<double> drive;     // N m, torque of the motor at each sample; none: a step from before to after
};

struct WaveformGrid {
  double step = 0;                  // s, of the integration, at most
  double base_radius = 0;           // m
  double level = 1;                 // N m, usual torque
  double usual_depth = 1;           // m, penetration of the declared teeth under it
  bool sensor_with_damper = false;  // the sensor shows T and not the spring's share
  WaveformOutput output = WaveformOutput::locked;
  double exponent = kHertzExponent;  // of the contact
};

/// One column per set; all have `samples` rows.
using WaveformRows = std::vector<std::array<double, kWaveformSets>>;
struct WaveformMotion {
  WaveformRows torque, position;
};

/// Of the first `samples` of a window. `lacking`: some set has a value of what a rig file may lack. `motion`
/// keeps its memory from call to call.
void move_waveform(const WaveformWindow& window, const WaveformGrid& grid, std::size_t samples, bool lacking,
                   const WaveformSets& sets, WaveformMotion& motion);

}  // namespace backlash::diagnosis
