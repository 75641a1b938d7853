// SPDX-License-Identifier: BSD-3-Clause
// The motor side of a record as momentum_transfer.h sees it: the torque that it puts on the flank, averaged,
// and the crossings of the gap that show in it.
#pragma once

#include <cstddef>
#include <vector>

#include "backlash_diagnosis/diagnosis/momentum_transfer.h"

namespace backlash::diagnosis::momentum {

constexpr std::size_t kFewestCrossings = 4;  // theory: for a scatter
constexpr double kNoiseFree = 5;             // theory: standard deviations of F below half of its median

/// Motion of the motor side, sample by sample.
struct Motor {
  double interval = 0;                          // s
  bool torque_measured = true;                  // else estimated from the motion
  bool tachometer = false;                      // speed is measured, position its integral; else the reverse
  std::vector<double> torque, speed, position;  // N m, rad/s, rad
  std::vector<double> load;                     // rad at the motor axis
};

/// Torque that the motor transmits [N m], and the resulting position of the pinion [rad].
struct Pinion {
  std::vector<double> torque, position;
};

/// One flight from flank to flank.
struct Crossing {
  int side = 1;                    // flank that is hit
  double release = 0, impact = 0;  // sample
  double impact_torque = 0;        // N m, F at `impact`
};

/// F of momentum_transfer.h and what it is estimated from.
struct Flank {
  Pinion pinion;
  std::vector<double> torque;   // N m, averaged
  double level = 0, noise = 0;  // N m: median of its size, standard deviation
  std::size_t half = 0;         // samples, half width of the averages
};

bool flexible(const MomentumTransferSettings& s);
double inertia_at_flank(const MomentumTransferSettings& s);
/// Cycle [s] of motor against pinion, both free; 0 for a rigid coupling.
double internal_cycle(const MomentumTransferSettings& s);

/// Central differences over `reach` samples to each side, fewer at the ends.
std::vector<double> differentiated(const std::vector<double>& x, double interval, std::size_t reach = 1);
/// Mean over `reach` intervals to each side of a value that is held from its sample to the next.
std::vector<double> mean_of_held(const std::vector<double>& x, std::size_t reach);
/// Between two samples.
double at(const std::vector<double>& x, double index);

/// Throws Refusal where a channel is missing or the record is not what the settings say. Without motor_torque
/// the torque is 0.
Motor collect(const record::Record& record, const MomentumTransferSettings& settings);
Pinion reconstruct(const Motor& motor, const MomentumTransferSettings& s, std::size_t half);
/// F, averaged over `half` samples to each side; 0 at the ends.
std::vector<double> flank_torque(const Pinion& pinion, double inertia, double interval, std::size_t half);
/// Standard deviation of F for noise of 1 in every sample of the torque or of the motion.
double noise_gain(bool of_torque, bool tachometer, double interval, std::size_t half,
                  const MomentumTransferSettings& s);
/// Of the averages, half width [samples].
double longest_average(const MomentumTransferSettings& s, double interval);
/// Standard deviation of the noise of what is measured of the motion; at least that of its steps.
double motion_noise(const Motor& motor);
/// With the shortest averages in which F exceeds the noise; throws Refusal if there are none.
Flank calm_flank(const Motor& motor, const MomentumTransferSettings& s);

/// Share of the averaging time that remains after an impact; 1 on a rigid flank. The impact lasts half a
/// cycle of the stopped mass on the flank, with the flank's stiffness at its resting torque.
double shortness_of_impacts(const Flank& flank, double interval, const MomentumTransferSettings& s);
/// Crossings from flank to flank: |F| falls below half of its level, then F exceeds it on the other side.
std::vector<Crossing> find_crossings(const Flank& flank, double shortness);

}  // namespace backlash::diagnosis::momentum
