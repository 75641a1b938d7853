// SPDX-License-Identifier: BSD-3-Clause
// All parameters of a servo with two inertias and two encoders together, from the raw record, by the
// multi-start fit.
//
// The load is simulated driven by the recorded motor position (simulation/driven_load.h). Two residuals
// count, each divided by its noise floor, which is estimated from the record itself:
//   torque      recorded - [J_M a_M + friction + mesh torque], both through the same zero-phase low-pass;
//   samples near
//               standstill do not count, there dry friction takes any value
//   deflection  (motor - load) recorded - simulated, through the same low-pass
// A torque that is held between samples acts half a sample later than its stamp; whether it is, the fitted
// delay shows. A further delay of a part of a sample is calibration and fitted. So is the constant difference
// of the two encoders.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/finding.h"
#include "backlash_diagnosis/identification/fit/fit_settings.h"
#include "backlash_diagnosis/identification/fit/servo_data.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/simulation/driven_load.h"

namespace backlash::identification {

struct OutputErrorSettings {
  FitSettings fit;
  std::vector<std::string> parameters;  // of servo_parameters(), to be fitted
  std::vector<Finding> findings;        // of other records, which count by their standard errors
};

/// Relative error norm(r) / norm(y - mean(y)), and what noise alone leaves.
struct ChannelError {
  double error = 0, floor = 0;
};

/// What belongs to a record and not to the machine.
struct Calibration {
  double torque_delay = 0;    // samples, beyond that of the hold
  double encoder_offset = 0;  // rad, load encoder minus motor encoder in the middle of the gap
  double encoder_drift = 0;   // rad/s, by which the motor's position grows beside the teeth's
  double torque_offset = 0;   // N m, that the record shows beside the motor's torque
  bool held = true;  // the torque is held from its sample to the next, as loops command it; else it is that
                     // of the moment
};

/// What a rig predicts for a record; no deflection where the load has no motion of its own.
struct ServoPrediction {
  simulation::DrivenLoad load;
  std::vector<double> torque, measured_torque;          // N m, both low-passed
  std::vector<double> deflection, measured_deflection;  // rad
  std::vector<char> settled, counts;                    // whether the sample of deflection and torque counts
  double torque_floor, deflection_floor;  // N m, rad: standard deviation of what noise alone leaves
  ChannelError torque_error, deflection_error;
};

struct OutputError {
  model::Rig rig;                                      // fitted
  std::map<std::string, signal::Measured> parameters;  // in the units of the rig file
  std::vector<Calibration> calibrations;               // one per record
  std::vector<ServoPrediction> predictions;            // one per record
  std::vector<signal::Measured> torque_offsets;        // N m, one per record of a locked output
  std::vector<std::string> lacking;  // effects of the dictionary that a locked output shows beside the rig's
};

/// `settings` have their bands, see with_bands(); throws InvalidParameter for a cutoff that is not > 0.
ServoPrediction predict_servo(const model::Rig& rig, const ServoData& data, const FitSettings& settings,
                              const Calibration& calibration);

/// Fits the calibration alone and predicts: what a rig says of a record that it has not seen.
ServoPrediction predict_calibrated(const model::Rig& rig, const ServoData& data, const FitSettings& settings,
                                   Calibration& calibration);

/// Starts from the values in `rig`; bands that the settings do not have are those of `rig`. Throws
/// CannotIdentify, InvalidParameter.
OutputError fit_output_error(const model::Rig& rig, const std::vector<ServoData>& records,
                             const OutputErrorSettings& settings);

}  // namespace backlash::identification
